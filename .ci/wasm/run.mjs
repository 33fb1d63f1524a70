// Runs the main function of a wasm32-unknown-unknown program; a panic or an error exits with 1.
import { readFileSync } from "node:fs";
const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[2]));
process.exit(instance.exports.main(0, 0) === 0 ? 0 : 1);
