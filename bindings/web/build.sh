#!/bin/sh
# Writes one HTML file that holds the live page and all that it needs: it learns and reaches in the
# browser's tab, from a web server or from the disk.
#
#     bindings/web/build.sh [FILE [PROFILE]]      out/puma_grasp.html and release by default
set -eu
cd "$(dirname "$0")/../.."
out=${1:-out/puma_grasp.html}
profile=${2:-release}
target=${CARGO_TARGET_DIR:-target}
mkdir -p "$(dirname "$out")"
cargo build --quiet --locked --manifest-path bindings/web/Cargo.toml --profile "$profile" \
  --target wasm32-unknown-unknown --target-dir "$target"
module=$target/wasm32-unknown-unknown/$([ "$profile" = dev ] && echo debug || echo "$profile")
module=$module/puma_grasp_web.wasm
base64 "$module" | awk '
  FNR == NR { code = code "\n" $0; next }
  /<script id="wasm"/ { sub(/<\/script>/, code "\n</script>") }
  { print }
' - examples/support/src/live/page.html >"$out"
echo "$out: $(($(wc -c <"$out") / 1024)) kB; open it in a browser"
