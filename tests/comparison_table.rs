//! The table of `examples/compare_controllers`, whose tests would not run with the others.

#[allow(dead_code, reason = "of the example, the table only")]
#[path = "../examples/compare_controllers/table.rs"]
mod table;
