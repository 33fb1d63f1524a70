//! Arithmetic expressions: parsing and evaluation. Truth is -1, falsehood 0.

use crate::emulator::language::lexer::{Cursor, Token};
use crate::emulator::language::place_expr::PlaceExpr;
use crate::emulator::language::scope::Scope;
use crate::emulator::message::{Fault, Message};

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expr {
    Number(f64),
    Variable(Variable),
    Negate(Box<Expr>),
    Not(Box<Expr>),
    Binary(Operator, Box<Expr>, Box<Expr>),
    Call(Function, Vec<Expr>),
    OfPlaces(PlaceFunction, Vec<PlaceExpr>),
}

/// Real variable, possibly an element of an array.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) index: Option<Box<Expr>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operator {
    Or,
    Xor,
    And,
    Equal,
    Unequal,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Add,
    Subtract,
    Multiply,
    Divide,
    Modulo,
    Power,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Function {
    Abs,
    Atan2,
    Cos,
    Fraction,
    Int,
    Max,
    Min,
    Pi,
    Sig,
    Sign,
    Sin,
    Sqr,
    Sqrt,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlaceFunction {
    Distance,
    Dx,
    Dy,
    Dz,
}

const FUNCTIONS: [(&str, Function); 12] = [
    ("ABS", Function::Abs),
    ("ATAN2", Function::Atan2),
    ("COS", Function::Cos),
    ("FRACT", Function::Fraction),
    ("INT", Function::Int),
    ("MAX", Function::Max),
    ("MIN", Function::Min),
    ("SIG", Function::Sig),
    ("SIGN", Function::Sign),
    ("SIN", Function::Sin),
    ("SQR", Function::Sqr),
    ("SQRT", Function::Sqrt),
];

const PLACE_FUNCTIONS: [(&str, PlaceFunction); 4] = [
    ("DISTANCE", PlaceFunction::Distance),
    ("DX", PlaceFunction::Dx),
    ("DY", PlaceFunction::Dy),
    ("DZ", PlaceFunction::Dz),
];

/// Binary operators and their binding strengths, loosest first.
const OPERATORS: [(&str, Operator, u8); 24] = [
    ("OR", Operator::Or, 1),
    ("XOR", Operator::Xor, 1),
    ("AND", Operator::And, 2),
    ("==", Operator::Equal, 4),
    ("EQ", Operator::Equal, 4),
    ("<>", Operator::Unequal, 4),
    ("NE", Operator::Unequal, 4),
    ("<=", Operator::LessEqual, 4),
    ("=<", Operator::LessEqual, 4),
    ("LE", Operator::LessEqual, 4),
    (">=", Operator::GreaterEqual, 4),
    ("=>", Operator::GreaterEqual, 4),
    ("GE", Operator::GreaterEqual, 4),
    ("<", Operator::Less, 4),
    ("LT", Operator::Less, 4),
    (">", Operator::Greater, 4),
    ("GT", Operator::Greater, 4),
    ("=", Operator::Equal, 4),
    ("+", Operator::Add, 5),
    ("-", Operator::Subtract, 5),
    ("*", Operator::Multiply, 6),
    ("/", Operator::Divide, 6),
    ("MOD", Operator::Modulo, 6),
    ("^", Operator::Power, 8),
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

    fn parse_from(cursor: &mut Cursor<'_>, loosest: u8) -> Result<Self, Fault> {
        cursor.descend()?;
        let mut left = Self::parse_operand(cursor)?;
        while let Some(&(_, operator, binds)) = cursor.peek().and_then(|token| {
            OPERATORS.iter().find(|(text, _, _)| match token {
                Token::Sign(sign) => sign == text,
                Token::Name(name) => name == text,
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
            Some(Token::Sign("-")) => Ok(Self::Negate(Box::new(Self::parse_from(
                cursor, SIGN_BINDS,
            )?))),
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

    fn parse_name(name: &str, cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        match name {
            "NOT" => return Ok(Self::Not(Box::new(Self::parse_from(cursor, NOT_BINDS)?))),
            "TRUE" | "ON" => return Ok(Self::Number(-1.0)),
            "FALSE" | "OFF" => return Ok(Self::Number(0.0)),
            "PI" => return Ok(Self::Call(Function::Pi, Vec::new())),
            _ => {}
        }
        if cursor.sign("(") {
            if let Some((_, function)) = PLACE_FUNCTIONS.iter().find(|(word, _)| *word == name) {
                let mut places = vec![PlaceExpr::parse(cursor)?];
                while cursor.sign(",") {
                    places.push(PlaceExpr::parse(cursor)?);
                }
                cursor.expect_sign(")")?;
                let wanted = if *function == PlaceFunction::Distance {
                    2
                } else {
                    1
                };
                if places.len() != wanted {
                    return Err(Message::InvalidArgument.into());
                }
                return Ok(Self::OfPlaces(*function, places));
            }
            let (_, function) = FUNCTIONS
                .iter()
                .find(|(word, _)| *word == name)
                .ok_or(Message::InvalidArgument)?;
            let mut arguments = Vec::new();
            if !cursor.sign(")") {
                arguments.push(Self::parse(cursor)?);
                while cursor.sign(",") {
                    arguments.push(Self::parse(cursor)?);
                }
                cursor.expect_sign(")")?;
            }
            let fits = match function {
                Function::Atan2 => arguments.len() == 2,
                Function::Max | Function::Min | Function::Sig => !arguments.is_empty(),
                _ => arguments.len() == 1,
            };
            return if fits {
                Ok(Self::Call(*function, arguments))
            } else {
                Err(Message::InvalidArgument.into())
            };
        }
        let index = parse_index(cursor)?;
        Ok(Self::Variable(Variable {
            name: name.to_owned(),
            index,
        }))
    }

    pub(crate) fn value(&self, scope: &dyn Scope) -> Result<f64, Fault> {
        let value = match self {
            Self::Number(number) => *number,
            Self::Variable(variable) => scope.real(&variable.key(scope)?)?,
            Self::Negate(inner) => -inner.value(scope)?,
            Self::Not(inner) => truth(!is_true(inner.value(scope)?)),
            Self::Binary(operator, left, right) => {
                operator.apply(left.value(scope)?, right.value(scope)?)?
            }
            Self::Call(function, arguments) => {
                let values = arguments
                    .iter()
                    .map(|a| a.value(scope))
                    .collect::<Result<Vec<_>, _>>()?;
                function.apply(&values, scope)?
            }
            Self::OfPlaces(function, places) => function.apply(places, scope)?,
        };
        if value.is_finite() {
            Ok(value)
        } else {
            Err(Message::ArithmeticError.into())
        }
    }
}

/// Parses an index in brackets, if one follows.
pub(crate) fn parse_index(cursor: &mut Cursor<'_>) -> Result<Option<Box<Expr>>, Fault> {
    if !cursor.sign("[") {
        return Ok(None);
    }
    let index = Expr::parse(cursor)?;
    cursor.expect_sign("]")?;
    Ok(Some(Box::new(index)))
}

impl Variable {
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        let name = cursor.name()?;
        let index = parse_index(cursor)?;
        Ok(Self { name, index })
    }

    /// Returns the name under which the value is kept: `A`, or `A[3]`.
    pub(crate) fn key(&self, scope: &dyn Scope) -> Result<String, Fault> {
        key(&self.name, self.index.as_deref(), scope)
    }
}

/// Returns the name under which a value is kept: `A`, or `A[3]`.
pub(crate) fn key(name: &str, index: Option<&Expr>, scope: &dyn Scope) -> Result<String, Fault> {
    scope.check_name(name)?;
    match index {
        None => Ok(name.to_owned()),
        Some(index) => Ok(format!("{name}[{}]", whole(index.value(scope)?, 0, 32767)?)),
    }
}

/// Converts to a whole number within bounds.
pub(crate) fn whole(value: f64, min: i32, max: i32) -> Result<i32, Fault> {
    let rounded = value.trunc();
    if rounded >= f64::from(min) && rounded <= f64::from(max) {
        // In range, so the conversion is exact.
        Ok(rounded as i32)
    } else {
        Err(Message::InvalidArgument.into())
    }
}

pub(crate) fn truth(condition: bool) -> f64 {
    if condition { -1.0 } else { 0.0 }
}

pub(crate) fn is_true(value: f64) -> bool {
    value != 0.0
}

impl Operator {
    #[allow(clippy::float_cmp)] // VAL's `==` compares as the controller does.
    fn apply(self, a: f64, b: f64) -> Result<f64, Fault> {
        Ok(match self {
            Self::Or => truth(is_true(a) || is_true(b)),
            Self::Xor => truth(is_true(a) != is_true(b)),
            Self::And => truth(is_true(a) && is_true(b)),
            Self::Equal => truth(a == b),
            Self::Unequal => truth(a != b),
            Self::Less => truth(a < b),
            Self::LessEqual => truth(a <= b),
            Self::Greater => truth(a > b),
            Self::GreaterEqual => truth(a >= b),
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide | Self::Modulo if b == 0.0 => return Err(Message::ArithmeticError.into()),
            Self::Divide => a / b,
            Self::Modulo => a % b,
            Self::Power => a.powf(b),
        })
    }
}

impl Function {
    fn apply(self, values: &[f64], scope: &dyn Scope) -> Result<f64, Fault> {
        let first = values.first().copied().unwrap_or_default();
        Ok(match self {
            Self::Abs => first.abs(),
            Self::Atan2 => first.atan2(values[1]).to_degrees(),
            Self::Cos => first.to_radians().cos(),
            Self::Fraction => first.fract(),
            Self::Int => first.trunc(),
            Self::Max => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            Self::Min => values.iter().copied().fold(f64::INFINITY, f64::min),
            Self::Pi => std::f64::consts::PI,
            Self::Sig => {
                let mut all = true;
                for &value in values {
                    all &= scope.signal(value)?;
                }
                truth(all)
            }
            Self::Sign => {
                if first < 0.0 {
                    -1.0
                } else {
                    1.0
                }
            }
            Self::Sin => first.to_radians().sin(),
            Self::Sqr => first * first,
            Self::Sqrt if first < 0.0 => return Err(Message::ArithmeticError.into()),
            Self::Sqrt => first.sqrt(),
        })
    }
}

impl PlaceFunction {
    fn apply(self, places: &[PlaceExpr], scope: &dyn Scope) -> Result<f64, Fault> {
        let first = places[0].transformation(scope)?.translation.vector;
        Ok(1000.0
            * match self {
                Self::Distance => {
                    (places[1].transformation(scope)?.translation.vector - first).norm()
                }
                Self::Dx => first.x,
                Self::Dy => first.y,
                Self::Dz => first.z,
            })
    }
}
