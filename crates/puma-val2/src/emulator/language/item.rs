//! Parts of what `TYPE` prints.

use crate::emulator::language::expr::Expr;
use crate::emulator::language::lexer::Cursor;
use crate::emulator::message::{Fault, Message};

/// Part of the output of `TYPE`.
#[derive(Clone, Debug)]
pub(crate) enum Item {
    /// A text, or `/B`: the bell.
    Text(String),
    Value(Expr),
    /// `/Xn`: blanks.
    Blanks(usize),
    /// `/Cn`: line ends.
    Lines(usize),
    /// `/S`: no line end at the end.
    Stay,
    /// `/Fw.d`: fixed point from here on. `/Iw`: whole numbers. `/D`: back to the default.
    Format(Option<(usize, usize)>),
}

impl Item {
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        if let Some(text) = cursor.text() {
            return Ok(Item::Text(text));
        }
        if !cursor.sign("/") {
            return Expr::parse(cursor).map(Item::Value);
        }
        let word = cursor.name()?;
        let number = |text: &str| match text {
            "" => Some(1),
            _ => text.parse::<usize>().ok().filter(|n| *n <= 80),
        };
        let (letter, rest) = word.split_at(1);
        let item = match letter {
            "X" => number(rest).map(Item::Blanks),
            "C" => number(rest).map(Item::Lines),
            "B" if rest.is_empty() => Some(Item::Text("\u{7}".to_owned())),
            "I" => number(rest).map(|width| Item::Format(Some((width, 0)))),
            "S" if rest.is_empty() => Some(Item::Stay),
            "D" if rest.is_empty() => Some(Item::Format(None)),
            "F" => rest.split_once('.').and_then(|(width, decimals)| {
                let decimals = number(decimals).filter(|d| *d <= 10)?;
                Some(Item::Format(Some((number(width)?, decimals))))
            }),
            _ => None,
        };
        item.ok_or(Message::InvalidArgument.into())
    }
}
