//! Arguments of `CALL`.

use crate::emulator::language::expr::Expr;
use crate::emulator::language::lexer::{Cursor, Token};
use crate::emulator::language::place_expr::{PlaceExpr, PlaceName};
use crate::emulator::message::Fault;

/// Argument of `CALL`.
#[derive(Clone, Debug)]
pub(crate) enum Argument {
    /// A variable or location, which the program called may change.
    Named(PlaceName),
    Number(Expr),
    Place(PlaceExpr),
}

/// Parses the arguments in brackets, if there are any.
pub(crate) fn arguments_of_call(cursor: &mut Cursor<'_>) -> Result<Vec<Argument>, Fault> {
    let mut arguments = Vec::new();
    if cursor.sign("(") && !cursor.sign(")") {
        arguments = cursor.list(argument)?;
        cursor.expect_sign(")")?;
    }
    Ok(arguments)
}

fn argument(cursor: &mut Cursor<'_>) -> Result<Argument, Fault> {
    let ends = |c: &Cursor<'_>| matches!(c.peek(), Some(Token::Sign("," | ")")));
    let before = cursor.clone();
    if let Ok(name) = PlaceName::parse(cursor)
        && ends(cursor)
    {
        return Ok(Argument::Named(name));
    }
    *cursor = before.clone();
    if let Ok(number) = Expr::parse(cursor)
        && ends(cursor)
    {
        return Ok(Argument::Number(number));
    }
    *cursor = before;
    PlaceExpr::parse(cursor).map(Argument::Place)
}
