//! Location expressions: names, `TRANS`, `#PPOINT`, `SHIFT`, `INVERSE`, `FRAME` and compounds.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::emulator::language::expr;
use crate::emulator::language::expr::Expr;
use crate::emulator::language::lexer::{Cursor, Token};
use crate::emulator::language::place::Place;
use crate::emulator::language::scope::Scope;
use crate::emulator::message::{Fault, Message};
use crate::joints::Joints;
use crate::kinematics::xyzoat::Xyzoat;

/// Name of a location: `P1`, `#P1`, `P[3]`.
#[derive(Clone, Debug)]
pub(crate) struct PlaceName {
    pub(crate) precision: bool,
    pub(crate) name: String,
    pub(crate) index: Box<[Expr]>,
}

impl PlaceName {
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        let precision = cursor.sign("#");
        let name = cursor.name()?;
        let index = expr::parse_index(cursor)?;
        Ok(Self {
            precision,
            name,
            index,
        })
    }

    /// Parses names joined by `:`.
    pub(crate) fn parse_compound(cursor: &mut Cursor<'_>) -> Result<Vec<Self>, Fault> {
        let mut names = vec![Self::parse(cursor)?];
        while cursor.sign(":") {
            names.push(Self::parse(cursor)?);
        }
        Ok(names)
    }

    /// Returns the name under which the value is kept; that of a precision point begins with `#`.
    pub(crate) fn key(&self, scope: &dyn Scope) -> Result<String, Fault> {
        let key = expr::key(&self.name, &self.index, scope)?;
        Ok(if self.precision {
            format!("#{key}")
        } else {
            key
        })
    }
}

/// Location expression: terms joined by `:`.
#[derive(Clone, Debug)]
pub(crate) struct PlaceExpr(Vec<Term>);

#[derive(Clone, Debug)]
enum Term {
    Named(PlaceName),
    Trans([Option<Expr>; 6]),
    /// `RX`, `RY`, `RZ`: a turn about this axis, degrees.
    Turn(usize, Box<Expr>),
    Ppoint([Option<Expr>; 6]),
    Shift(Box<PlaceExpr>, [Option<Expr>; 3]),
    /// `SCALE`: the position times a factor.
    Scale(Box<PlaceExpr>, Box<Expr>),
    Inverse(Box<PlaceExpr>),
    Frame(Box<[PlaceExpr; 4]>),
    Here,
    Dest,
    Null,
}

impl PlaceExpr {
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        cursor.descend()?;
        let mut terms = vec![Term::parse(cursor)?];
        while cursor.sign(":") {
            terms.push(Term::parse(cursor)?);
        }
        cursor.ascend();
        Ok(Self(terms))
    }

    /// Returns the value. A precision point stands alone: it cannot be part of a compound.
    pub(crate) fn place(&self, scope: &dyn Scope) -> Result<Place, Fault> {
        let (first, rest) = self.0.split_first().ok_or(Message::InvalidArgument)?;
        let first = first.place(scope)?;
        if rest.is_empty() {
            return Ok(first);
        }
        let mut pose = transformation(first)?;
        for term in rest {
            pose *= transformation(term.place(scope)?)?;
        }
        Ok(Place::Transformation(pose))
    }

    /// Returns the value, which must be a transformation.
    pub(crate) fn transformation(&self, scope: &dyn Scope) -> Result<Isometry3<f64>, Fault> {
        transformation(self.place(scope)?)
    }
}

fn transformation(place: Place) -> Result<Isometry3<f64>, Fault> {
    match place {
        Place::Transformation(pose) => Ok(pose),
        Place::PrecisionPoint(_) => Err(Message::InvalidArgument.into()),
    }
}

impl Term {
    fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        let is_call = matches!(cursor.peek_second(), Some(Token::Sign("(")));
        match cursor.peek() {
            Some(Token::Name(name)) if is_call => {
                cursor.next();
                cursor.next();
                let term = match name.as_str() {
                    "TRANS" => Self::Trans(arguments(cursor)?),
                    "PPOINT" => Self::Ppoint(arguments(cursor)?),
                    "RX" => Self::Turn(0, Box::new(Expr::parse(cursor)?)),
                    "RY" => Self::Turn(1, Box::new(Expr::parse(cursor)?)),
                    "RZ" => Self::Turn(2, Box::new(Expr::parse(cursor)?)),
                    "SHIFT" => {
                        let of = PlaceExpr::parse(cursor)?;
                        cursor.expect_word("BY")?;
                        Self::Shift(Box::new(of), arguments(cursor)?)
                    }
                    "SCALE" => {
                        let of = PlaceExpr::parse(cursor)?;
                        cursor.expect_word("BY")?;
                        Self::Scale(Box::new(of), Box::new(Expr::parse(cursor)?))
                    }
                    "INVERSE" => Self::Inverse(Box::new(PlaceExpr::parse(cursor)?)),
                    "FRAME" => {
                        let of = cursor.list(PlaceExpr::parse)?.try_into();
                        Self::Frame(Box::new(of.map_err(|_| Message::InvalidArgument)?))
                    }
                    _ => return Err(cursor.unknown_word(name)),
                };
                cursor.expect_sign(")")?;
                Ok(term)
            }
            Some(Token::Name(name)) => {
                let fixed = match name.as_str() {
                    "HERE" => Self::Here,
                    "DEST" => Self::Dest,
                    "NULL" => Self::Null,
                    _ => return Ok(Self::Named(PlaceName::parse(cursor)?)),
                };
                cursor.next();
                Ok(fixed)
            }
            Some(Token::Sign("#")) => {
                let name = PlaceName::parse(cursor)?;
                if name.name == "PPOINT" && cursor.sign("(") {
                    let values = arguments(cursor)?;
                    cursor.expect_sign(")")?;
                    return Ok(Self::Ppoint(values));
                }
                Ok(Self::Named(name))
            }
            _ => Err(Message::InvalidArgument.into()),
        }
    }

    fn place(&self, scope: &dyn Scope) -> Result<Place, Fault> {
        Ok(match self {
            Self::Named(name) => scope.place(&name.key(scope)?)?,
            Self::Trans(arguments) => {
                Place::Transformation(Xyzoat::from_val(values(arguments, scope)?).pose())
            }
            Self::Turn(axis, angle) => {
                let mut turn = Vector3::zeros();
                turn[*axis] = angle.value(scope)?.to_radians();
                Place::Transformation(Isometry3::rotation(turn))
            }
            Self::Ppoint(_) if !scope.has_ppoint() => return Err(Message::InvalidArgument.into()),
            Self::Ppoint(arguments) => {
                Place::PrecisionPoint(Joints::from_degrees(values(arguments, scope)?))
            }
            Self::Shift(of, by) => {
                let by = Vector3::from(values(by, scope)?) / 1000.0;
                let mut pose = of.transformation(scope)?;
                pose.translation.vector += by;
                Place::Transformation(pose)
            }
            Self::Scale(of, by) => {
                let mut pose = of.transformation(scope)?;
                pose.translation.vector *= by.value(scope)?;
                Place::Transformation(pose)
            }
            Self::Inverse(of) => Place::Transformation(of.transformation(scope)?.inverse()),
            Self::Frame(of) => {
                let [a, b, c, d] = &**of;
                let at = |p: &PlaceExpr| p.transformation(scope).map(|t| t.translation.vector);
                Place::Transformation(frame(at(a)?, at(b)?, at(c)?, at(d)?)?)
            }
            Self::Here => Place::Transformation(scope.here()),
            Self::Dest => Place::Transformation(scope.destination()),
            Self::Null => Place::Transformation(Isometry3::identity()),
        })
    }
}

/// Parses up to `N` arguments between commas; those left out are zero.
pub(crate) fn arguments<const N: usize>(
    cursor: &mut Cursor<'_>,
) -> Result<[Option<Expr>; N], Fault> {
    let mut found = [const { None }; N];
    for (i, place) in found.iter_mut().enumerate() {
        if i > 0 && !cursor.sign(",") {
            break;
        }
        *place = Expr::parse_optional(cursor)?;
    }
    Ok(found)
}

/// Returns the values of arguments, zero for those left out.
pub(crate) fn values<const N: usize>(
    arguments: &[Option<Expr>; N],
    scope: &dyn Scope,
) -> Result<[f64; N], Fault> {
    let mut found = [0.0; N];
    for (value, argument) in found.iter_mut().zip(arguments) {
        if let Some(argument) = argument {
            *value = argument.value(scope)?;
        }
    }
    Ok(found)
}

/// Returns a frame with its x axis from `a` to `b`, its xy plane through `c` (at positive y) and
/// its origin at `d`.
fn frame(
    a: Vector3<f64>,
    b: Vector3<f64>,
    c: Vector3<f64>,
    d: Vector3<f64>,
) -> Result<Isometry3<f64>, Fault> {
    let too_close = Fault::from(Message::InvalidArgument);
    let x = (b - a)
        .try_normalize(1e-9)
        .ok_or_else(|| too_close.clone())?;
    let z = x.cross(&(c - a)).try_normalize(1e-12).ok_or(too_close)?;
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Ok(Isometry3::from_parts(
        Translation3::from(d),
        UnitQuaternion::from_rotation_matrix(&rotation),
    ))
}
