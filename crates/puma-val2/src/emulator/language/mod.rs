//! The VAL II language: tokens, expressions, locations, instructions, programs. It parses and
//! evaluates; it carries nothing out.

pub(crate) mod argument;
pub(crate) mod expr;
pub(crate) mod instruction;
pub(crate) mod item;
pub(crate) mod lexer;
pub(crate) mod place;
pub(crate) mod place_expr;
pub(crate) mod program;
pub(crate) mod scope;
pub(crate) mod val;
