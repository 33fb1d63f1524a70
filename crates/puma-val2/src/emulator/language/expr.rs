//! Arithmetic expressions: parsing and evaluation. Truth is -1, falsehood 0.

use std::f64::consts::PI;

use nalgebra::Vector3;

use crate::emulator::language::lexer::{Cursor, GREATEST, Token};
use crate::emulator::language::place_expr::{PlaceExpr, PlaceName};
use crate::emulator::language::scope::Scope;
use crate::emulator::message::{Fault, Message};

type OfTwo = fn(f64, f64) -> f64;
type OfNumbers = fn(&[f64]) -> f64;
type OfPositions = fn(&[Vector3<f64>]) -> f64;

#[derive(Clone, Debug)]
pub(crate) enum Expr {
    Number(f64),
    Variable(Variable),
    Negate(Box<Expr>),
    Not(Box<Expr>),
    Binary(OfTwo, Box<Expr>, Box<Expr>),
    Call(OfNumbers, Vec<Expr>),
    OfPlaces(OfPositions, Vec<PlaceExpr>),
    /// `SIG`: all of these signals are as their signs say.
    Signals(Vec<Expr>),
    /// `BITS`: the number whose binary digits are signals, from the first, this many.
    Bits(Box<[Expr; 2]>),
    /// `TIMER`: the seconds that this timer shows.
    Timer(Box<Expr>),
    /// `DEFINED`: the location has a value. `INRANGE`: 0 if the arm reaches it, otherwise 1.
    Defined(PlaceName),
    InRange(PlaceExpr),
}

/// Real variable, possibly an element of an array.
#[derive(Clone, Debug)]
pub(crate) struct Variable {
    pub(crate) name: String,
    /// Up to three indices.
    pub(crate) index: Box<[Expr]>,
}

/// Functions of numbers, with the least and the greatest number of arguments.
const FUNCTIONS: [(&str, [usize; 2], OfNumbers); 11] = [
    ("ABS", [1, 1], |v| v[0].abs()),
    ("ATAN2", [2, 2], |v| v[0].atan2(v[1]).to_degrees()),
    ("COS", [1, 1], |v| v[0].to_radians().cos()),
    ("FRACT", [1, 1], |v| v[0].fract()),
    ("INT", [1, 1], |v| v[0].trunc()),
    ("MAX", [1, 99], |v| v.iter().copied().fold(v[0], f64::max)),
    ("MIN", [1, 99], |v| v.iter().copied().fold(v[0], f64::min)),
    ("SIGN", [1, 1], |v| if v[0] < 0.0 { -1.0 } else { 1.0 }),
    ("SIN", [1, 1], |v| v[0].to_radians().sin()),
    ("SQR", [1, 1], |v| v[0] * v[0]),
    ("SQRT", [1, 1], |v| v[0].sqrt()),
];

/// Functions of the positions of locations, with the number of locations.
const PLACE_FUNCTIONS: [(&str, usize, OfPositions); 4] = [
    ("DISTANCE", 2, |p| (p[1] - p[0]).norm()),
    ("DX", 1, |p| p[0].x),
    ("DY", 1, |p| p[0].y),
    ("DZ", 1, |p| p[0].z),
];

/// Binary operators in all their spellings, and their binding strengths, loosest first.
#[allow(clippy::float_cmp)] // VAL's `==` compares as the controller does.
const OPERATORS: [(&[&str], u8, OfTwo); 18] = [
    (&["OR"], 1, |a, b| truth(is_true(a) || is_true(b))),
    (&["XOR"], 1, |a, b| truth(is_true(a) != is_true(b))),
    (&["BOR"], 1, |a, b| bitwise(a, b, |a, b| a | b)),
    (&["BXOR"], 1, |a, b| bitwise(a, b, |a, b| a ^ b)),
    (&["BAND"], 2, |a, b| bitwise(a, b, |a, b| a & b)),
    (&["AND"], 2, |a, b| truth(is_true(a) && is_true(b))),
    (&["==", "EQ", "="], 4, |a, b| truth(a == b)),
    (&["<>", "NE"], 4, |a, b| truth(a != b)),
    (&["<=", "=<", "LE"], 4, |a, b| truth(a <= b)),
    (&[">=", "=>", "GE"], 4, |a, b| truth(a >= b)),
    (&["<", "LT"], 4, |a, b| truth(a < b)),
    (&[">", "GT"], 4, |a, b| truth(a > b)),
    (&["+"], 5, |a, b| a + b),
    (&["-"], 5, |a, b| a - b),
    (&["*"], 6, |a, b| a * b),
    (&["/"], 6, |a, b| a / b),
    (&["MOD"], 6, |a, b| a % b),
    (&["^"], 8, f64::powf),
];

/// Binding strengths of `NOT` and of the sign.
const NOT_BINDS: u8 = 3;
const SIGN_BINDS: u8 = 7;

impl Expr {
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        Self::parse_from(cursor, 0)
    }

    /// Parses an expression, or nothing before a comma, a closing sign or the end.
    pub(crate) fn parse_optional(cursor: &mut Cursor<'_>) -> Result<Option<Self>, Fault> {
        match cursor.peek() {
            None | Some(Token::Sign("," | ")")) => Ok(None),
            Some(_) => Self::parse(cursor).map(Some),
        }
    }

    /// Parses one expression or more between commas.
    pub(crate) fn parse_list(cursor: &mut Cursor<'_>) -> Result<Vec<Self>, Fault> {
        cursor.list(Self::parse)
    }

    fn parse_from(cursor: &mut Cursor<'_>, loosest: u8) -> Result<Self, Fault> {
        cursor.descend()?;
        let mut left = Self::parse_operand(cursor)?;
        while let Some(&(_, binds, operator)) = cursor.peek().and_then(|token| {
            OPERATORS.iter().find(|(spellings, _, _)| match token {
                Token::Sign(sign) => spellings.contains(sign),
                Token::Name(name) => spellings.contains(&name.as_str()),
                _ => false,
            })
        }) {
            if binds < loosest {
                break;
            }
            cursor.operator()?;
            let right = Self::parse_from(cursor, binds + 1)?;
            left = Self::Binary(operator, Box::new(left), Box::new(right));
        }
        cursor.ascend();
        Ok(left)
    }

    fn parse_operand(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        match cursor.next() {
            Some(Token::Number(number)) => Ok(Self::Number(*number)),
            Some(Token::Sign("-")) => {
                let inner = Self::parse_from(cursor, SIGN_BINDS)?;
                Ok(Self::Negate(Box::new(inner)))
            }
            Some(Token::Sign("+")) => Self::parse_from(cursor, SIGN_BINDS),
            Some(Token::Sign("(")) => {
                let inner = Self::parse(cursor)?;
                cursor.expect_sign(")")?;
                Ok(inner)
            }
            Some(Token::Name(name)) => Self::parse_name(name, cursor),
            _ => Err(Message::InvalidArgument.into()),
        }
    }

    fn parse_name<'a>(name: &'a str, cursor: &mut Cursor<'a>) -> Result<Self, Fault> {
        match name {
            "NOT" => return Ok(Self::Not(Box::new(Self::parse_from(cursor, NOT_BINDS)?))),
            "TRUE" | "ON" => return Ok(Self::Number(-1.0)),
            "FALSE" | "OFF" => return Ok(Self::Number(0.0)),
            "PI" => return Ok(Self::Number(PI)),
            _ => {}
        }
        if !cursor.sign("(") {
            return Ok(Self::Variable(Variable {
                name: name.to_owned(),
                index: parse_index(cursor)?,
            }));
        }
        if let Some(&(_, count, function)) = PLACE_FUNCTIONS.iter().find(|f| f.0 == name) {
            let places = cursor.list(PlaceExpr::parse)?;
            if places.len() != count {
                return Err(Message::InvalidArgument.into());
            }
            cursor.expect_sign(")")?;
            return Ok(Self::OfPlaces(function, places));
        }
        if name == "DEFINED" || name == "INRANGE" {
            let of = match name {
                "DEFINED" => Self::Defined(PlaceName::parse(cursor)?),
                _ => Self::InRange(PlaceExpr::parse(cursor)?),
            };
            cursor.expect_sign(")")?;
            return Ok(of);
        }
        let mut arguments = Self::parse_list(cursor)?;
        cursor.expect_sign(")")?;
        match (name, arguments.len()) {
            ("SIG", _) => return Ok(Self::Signals(arguments)),
            ("TIMER", 1) => return Ok(Self::Timer(Box::new(arguments.swap_remove(0)))),
            ("BITS", 2) => {
                let two = arguments.try_into().map_err(|_| Message::InvalidArgument)?;
                return Ok(Self::Bits(Box::new(two)));
            }
            _ => {}
        }
        let fits = |f: &&(&str, [usize; 2], _)| {
            f.0 == name && (f.1[0]..=f.1[1]).contains(&arguments.len())
        };
        let found = FUNCTIONS
            .iter()
            .find(fits)
            .ok_or_else(|| cursor.unknown_word(name))?;
        Ok(Self::Call(found.2, arguments))
    }

    pub(crate) fn value(&self, scope: &dyn Scope) -> Result<f64, Fault> {
        let value = match self {
            Self::Number(number) => *number,
            Self::Variable(variable) => scope.real(&variable.key(scope)?)?,
            Self::Negate(inner) => -inner.value(scope)?,
            Self::Not(inner) => truth(!is_true(inner.value(scope)?)),
            Self::Binary(operator, left, right) => {
                operator(left.value(scope)?, right.value(scope)?)
            }
            Self::Call(function, arguments) => {
                let values: Result<Vec<_>, _> = arguments.iter().map(|a| a.value(scope)).collect();
                function(&values?)
            }
            Self::OfPlaces(function, places) => {
                let position = |p: &PlaceExpr| Ok(p.transformation(scope)?.translation.vector);
                let positions: Result<Vec<_>, Fault> = places.iter().map(position).collect();
                1000.0 * function(&positions?)
            }
            Self::Signals(signals) => {
                let mut all = true;
                for signal in signals {
                    all &= scope.signal(signal.value(scope)?)?;
                }
                truth(all)
            }
            Self::Bits(of) => {
                let first = whole(of[0].value(scope)?, 1, 2064)?;
                let count = whole(of[1].value(scope)?, 1, 16)?;
                let bit = |i: i32| {
                    scope
                        .signal(f64::from(first + i))
                        .map(|on| i32::from(on) << i)
                };
                f64::from((0..count).map(bit).sum::<Result<i32, Fault>>()?)
            }
            Self::Timer(number) => scope.timer(whole(number.value(scope)?, 0, 8)? as usize),
            Self::Defined(name) => {
                let key = name.key(scope)?;
                truth(scope.place(&key).is_ok() || scope.real(&key).is_ok())
            }
            Self::InRange(place) => f64::from(!scope.reaches(&place.place(scope)?)),
        };
        if value.abs() <= GREATEST {
            Ok(value)
        } else {
            // A division by zero or the root of a negative number among them.
            Err(Message::ArithmeticError.into())
        }
    }
}

/// Parses up to three indices in brackets, if they follow.
pub(crate) fn parse_index(cursor: &mut Cursor<'_>) -> Result<Box<[Expr]>, Fault> {
    if !cursor.sign("[") {
        return Ok(Box::default());
    }
    let index = Expr::parse_list(cursor)?;
    cursor.expect_sign("]")?;
    if index.len() > 3 {
        return Err(Message::InvalidArgument.into());
    }
    Ok(index.into())
}

impl Variable {
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        let name = cursor.name()?;
        let index = parse_index(cursor)?;
        Ok(Self { name, index })
    }

    /// Returns the name under which the value is kept: `A`, or `A[3]`.
    pub(crate) fn key(&self, scope: &dyn Scope) -> Result<String, Fault> {
        key(&self.name, &self.index, scope)
    }
}

/// Returns the name under which a value is kept: `A`, `A[3]`, `A[1,2]`.
pub(crate) fn key(name: &str, index: &[Expr], scope: &dyn Scope) -> Result<String, Fault> {
    scope.check_name(name)?;
    if index.is_empty() {
        return Ok(name.to_owned());
    }
    let one = |index: &Expr| whole(index.value(scope)?, 0, 32767).map(|i| i.to_string());
    let all: Result<Vec<_>, Fault> = index.iter().map(one).collect();
    Ok(format!("{name}[{}]", all?.join(",")))
}

/// Converts to a whole number within bounds.
pub(crate) fn whole(value: f64, min: i32, max: i32) -> Result<i32, Fault> {
    let rounded = value.trunc();
    if (f64::from(min)..=f64::from(max)).contains(&rounded) {
        // In range, so the conversion is exact.
        return Ok(rounded as i32);
    }
    Err(Message::InvalidArgument.into())
}

/// Works on the digits of whole numbers; others have no value.
fn bitwise(a: f64, b: f64, of: fn(i64, i64) -> i64) -> f64 {
    match (whole(a, i32::MIN, i32::MAX), whole(b, i32::MIN, i32::MAX)) {
        (Ok(a), Ok(b)) => of(a.into(), b.into()) as f64,
        _ => f64::NAN,
    }
}

fn truth(condition: bool) -> f64 {
    if condition { -1.0 } else { 0.0 }
}

pub(crate) fn is_true(value: f64) -> bool {
    value != 0.0
}
