//! Program instructions and their parser.

use crate::emulator::language::expr::{Expr, Variable};
use crate::emulator::language::lexer::{Cursor, Token, keyword};
use crate::emulator::language::place_expr::{PlaceExpr, PlaceName, arguments};
use crate::emulator::message::{Fault, Message};
use crate::kinematics::inverse::{ArmSide, Elbow, Wrist};
use crate::manipulator::Gripper;

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Instruction {
    /// An empty line or a comment.
    Remark,
    /// `MOVE`, `MOVES`, `MOVET`, `MOVEST`: the hand opening (millimetres) with the last two.
    Move {
        straight: bool,
        to: PlaceExpr,
        hand: Option<Expr>,
    },
    Appro {
        straight: bool,
        to: PlaceExpr,
        distance: Expr,
    },
    Depart {
        straight: bool,
        distance: Expr,
    },
    Drive([Expr; 3]),
    Draw([Option<Expr>; 3]),
    Align,
    Delay(Expr),
    Ready,
    Nest,
    /// `OPEN`, `CLOSE` (with the next motion) and `OPENI`, `CLOSEI` (at once), `RELAX`, `RELAXI`,
    /// `GRASP`.
    Hand {
        to: Gripper,
        at_once: bool,
    },
    Posture(Posture),
    Speed {
        value: Expr,
        unit: SpeedUnit,
        always: bool,
    },
    /// `COARSE`, `FINE`, `NULL`, `NONULL`, `INTON`, `INTOFF`: accepted; the emulated servos settle
    /// exactly.
    Settling,
    Break,
    Signal(Vec<Expr>),
    Reset,
    Wait(Expr),
    React {
        at_once: bool,
        signal: Expr,
        program: Option<String>,
    },
    Ignore(Expr),
    SetPlace(PlaceName, PlaceExpr),
    Assign(Variable, Expr),
    Here(PlaceName),
    Decompose(Variable, PlaceExpr),
    Tool(Option<PlaceExpr>),
    Base([Option<Expr>; 4]),
    Type(Vec<Item>),
    Prompt(Option<String>, Vec<Variable>),
    Goto(u32),
    IfGoto(Expr, u32),
    IfThen(Expr),
    Else,
    End,
    For {
        variable: Variable,
        from: Expr,
        to: Expr,
        step: Option<Expr>,
    },
    While(Expr),
    Do,
    Until(Expr),
    Case(Expr),
    Value(Vec<Expr>),
    Any,
    Call(String),
    Return,
    Pause,
    Stop,
    Halt,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Posture {
    Side(ArmSide),
    Elbow(Elbow),
    Wrist(Wrist),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SpeedUnit {
    Percent,
    MillimetresPerSecond,
    InchesPerSecond,
}

/// Part of the output of `TYPE`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Item {
    Text(String),
    Value(Expr),
    /// `/Xn`: blanks.
    Blanks(usize),
    /// `/Cn`: line ends.
    Lines(usize),
    /// `/S`: no line end at the end.
    Stay,
    /// `/Fw.d`: fixed point from here on. `/D`: back to the default.
    Format(Option<(usize, usize)>),
}

#[derive(Clone, Copy, Debug)]
enum Word {
    Plain(fn() -> Instruction),
    Parse(fn(&mut Cursor<'_>) -> Result<Instruction, Fault>),
}

use Word::{Parse, Plain};

const WORDS: [(&str, Word); 64] = [
    (
        "ABOVE",
        Plain(|| Instruction::Posture(Posture::Elbow(Elbow::Above))),
    ),
    ("ALIGN", Plain(|| Instruction::Align)),
    ("ANY", Plain(|| Instruction::Any)),
    ("APPRO", Parse(|c| appro(c, false))),
    ("APPROS", Parse(|c| appro(c, true))),
    ("BASE", Parse(|c| Ok(Instruction::Base(arguments(c)?)))),
    (
        "BELOW",
        Plain(|| Instruction::Posture(Posture::Elbow(Elbow::Below))),
    ),
    ("BREAK", Plain(|| Instruction::Break)),
    ("CALL", Parse(|c| Ok(Instruction::Call(c.name()?)))),
    ("CASE", Parse(case)),
    ("CLOSE", Parse(|c| hand(c, Gripper::Closed, false))),
    ("CLOSEI", Parse(|c| hand(c, Gripper::Closed, true))),
    ("COARSE", Parse(settling)),
    ("DECOMPOSE", Parse(decompose)),
    ("DELAY", Parse(|c| Ok(Instruction::Delay(Expr::parse(c)?)))),
    ("DEPART", Parse(|c| depart(c, false))),
    ("DEPARTS", Parse(|c| depart(c, true))),
    ("DO", Plain(|| Instruction::Do)),
    ("DRAW", Parse(|c| Ok(Instruction::Draw(arguments(c)?)))),
    ("DRIVE", Parse(drive)),
    ("ELSE", Plain(|| Instruction::Else)),
    ("END", Plain(|| Instruction::End)),
    ("FINE", Parse(settling)),
    (
        "FLIP",
        Plain(|| Instruction::Posture(Posture::Wrist(Wrist::Flip))),
    ),
    ("FOR", Parse(for_loop)),
    ("GOTO", Parse(|c| Ok(Instruction::Goto(label(c)?)))),
    ("GRASP", Parse(|c| hand(c, Gripper::Closed, true))),
    ("HALT", Plain(|| Instruction::Halt)),
    (
        "HERE",
        Parse(|c| Ok(Instruction::Here(PlaceName::parse(c)?))),
    ),
    ("IF", Parse(condition)),
    (
        "IGNORE",
        Parse(|c| Ok(Instruction::Ignore(Expr::parse(c)?))),
    ),
    ("INTOFF", Parse(settling)),
    ("INTON", Parse(settling)),
    (
        "LEFTY",
        Plain(|| Instruction::Posture(Posture::Side(ArmSide::Lefty))),
    ),
    ("MOVE", Parse(|c| motion(c, false, false))),
    ("MOVES", Parse(|c| motion(c, true, false))),
    ("MOVEST", Parse(|c| motion(c, true, true))),
    ("MOVET", Parse(|c| motion(c, false, true))),
    ("NEST", Plain(|| Instruction::Nest)),
    (
        "NOFLIP",
        Plain(|| Instruction::Posture(Posture::Wrist(Wrist::NoFlip))),
    ),
    ("NONULL", Parse(settling)),
    ("NULL", Parse(settling)),
    ("OPEN", Parse(|c| hand(c, Gripper::Open, false))),
    ("OPENI", Parse(|c| hand(c, Gripper::Open, true))),
    ("PAUSE", Plain(|| Instruction::Pause)),
    ("PROMPT", Parse(prompt)),
    ("REACT", Parse(|c| react(c, false))),
    ("REACTI", Parse(|c| react(c, true))),
    ("READY", Plain(|| Instruction::Ready)),
    ("RELAX", Parse(|c| hand(c, Gripper::Open, false))),
    ("RELAXI", Parse(|c| hand(c, Gripper::Open, true))),
    ("RESET", Plain(|| Instruction::Reset)),
    ("RETURN", Plain(|| Instruction::Return)),
    (
        "RIGHTY",
        Plain(|| Instruction::Posture(Posture::Side(ArmSide::Righty))),
    ),
    ("SET", Parse(set)),
    (
        "SIGNAL",
        Parse(|c| Ok(Instruction::Signal(expressions(c)?))),
    ),
    ("SPEED", Parse(speed)),
    ("STOP", Plain(|| Instruction::Stop)),
    ("TOOL", Parse(tool)),
    ("TYPE", Parse(print)),
    ("UNTIL", Parse(|c| Ok(Instruction::Until(Expr::parse(c)?)))),
    ("VALUE", Parse(value)),
    ("WAIT", Parse(|c| Ok(Instruction::Wait(Expr::parse(c)?)))),
    ("WHILE", Parse(while_loop)),
];

impl Instruction {
    /// Parses a whole instruction without its label.
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        let Some(first) = cursor.peek() else {
            return Ok(Self::Remark);
        };
        let Token::Name(name) = first else {
            return Err(Message::UnknownInstruction.into());
        };
        let instruction = if matches!(cursor.peek_second(), Some(Token::Sign("=" | "["))) {
            let variable = Variable::parse(cursor)?;
            cursor.expect_sign("=")?;
            Self::Assign(variable, Expr::parse(cursor)?)
        } else {
            cursor.next();
            match keyword(name, &WORDS, Message::UnknownInstruction)? {
                Plain(make) => make(),
                Parse(parse) => parse(cursor)?,
            }
        };
        cursor.expect_end()?;
        Ok(instruction)
    }

    /// Returns `true` if the instruction makes sense only among the steps of a program.
    pub(crate) fn needs_program(&self) -> bool {
        matches!(
            self,
            Self::Goto(_)
                | Self::IfGoto(..)
                | Self::IfThen(_)
                | Self::Else
                | Self::End
                | Self::For { .. }
                | Self::While(_)
                | Self::Do
                | Self::Until(_)
                | Self::Case(_)
                | Self::Value(_)
                | Self::Any
                | Self::Return
                | Self::Pause
                | Self::Stop
                | Self::Halt
        )
    }
}

fn appro(cursor: &mut Cursor<'_>, straight: bool) -> Result<Instruction, Fault> {
    let to = PlaceExpr::parse(cursor)?;
    cursor.expect_sign(",")?;
    Ok(Instruction::Appro {
        straight,
        to,
        distance: Expr::parse(cursor)?,
    })
}

fn depart(cursor: &mut Cursor<'_>, straight: bool) -> Result<Instruction, Fault> {
    Ok(Instruction::Depart {
        straight,
        distance: Expr::parse(cursor)?,
    })
}

fn drive(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let joint = Expr::parse(cursor)?;
    cursor.expect_sign(",")?;
    let change = Expr::parse(cursor)?;
    cursor.expect_sign(",")?;
    Ok(Instruction::Drive([joint, change, Expr::parse(cursor)?]))
}

fn motion(cursor: &mut Cursor<'_>, straight: bool, with_hand: bool) -> Result<Instruction, Fault> {
    let to = PlaceExpr::parse(cursor)?;
    let hand = if with_hand {
        cursor.expect_sign(",")?;
        Some(Expr::parse(cursor)?)
    } else {
        None
    };
    Ok(Instruction::Move { straight, to, hand })
}

fn hand(cursor: &mut Cursor<'_>, to: Gripper, at_once: bool) -> Result<Instruction, Fault> {
    // A servoed hand takes an opening in millimetres; the emulated one is pneumatic and only checks
    // that it is a number.
    Expr::parse_optional(cursor)?;
    Ok(Instruction::Hand { to, at_once })
}

fn settling(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    cursor.word("ALWAYS");
    Ok(Instruction::Settling)
}

fn speed(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let value = Expr::parse(cursor)?;
    let unit = if cursor.word("MMPS") {
        SpeedUnit::MillimetresPerSecond
    } else if cursor.word("IPS") {
        SpeedUnit::InchesPerSecond
    } else {
        SpeedUnit::Percent
    };
    Ok(Instruction::Speed {
        value,
        unit,
        always: cursor.word("ALWAYS"),
    })
}

fn expressions(cursor: &mut Cursor<'_>) -> Result<Vec<Expr>, Fault> {
    let mut found = vec![Expr::parse(cursor)?];
    while cursor.sign(",") {
        found.push(Expr::parse(cursor)?);
    }
    Ok(found)
}

fn react(cursor: &mut Cursor<'_>, at_once: bool) -> Result<Instruction, Fault> {
    let signal = Expr::parse(cursor)?;
    let mut program = None;
    if cursor.sign(",") {
        if let Some(Token::Name(_)) = cursor.peek() {
            program = Some(cursor.name()?);
        }
        // The priority orders reactions among each other; only one is served at a time here.
        if cursor.sign(",") {
            Expr::parse_optional(cursor)?;
        }
    }
    cursor.word("ALWAYS");
    Ok(Instruction::React {
        at_once,
        signal,
        program,
    })
}

fn set(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let name = PlaceName::parse(cursor)?;
    cursor.expect_sign("=")?;
    Ok(Instruction::SetPlace(name, PlaceExpr::parse(cursor)?))
}

fn decompose(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let into = Variable::parse(cursor)?;
    cursor.expect_sign("=")?;
    Ok(Instruction::Decompose(into, PlaceExpr::parse(cursor)?))
}

fn tool(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let to = if cursor.at_end() {
        None
    } else {
        Some(PlaceExpr::parse(cursor)?)
    };
    Ok(Instruction::Tool(to))
}

fn print(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let mut items = Vec::new();
    while !cursor.at_end() {
        if !items.is_empty() {
            cursor.expect_sign(",")?;
        }
        let item = match cursor.peek() {
            Some(Token::Text(text)) => {
                cursor.next();
                Item::Text(text.clone())
            }
            Some(Token::Sign("/")) => {
                cursor.next();
                format_item(&cursor.name()?)?
            }
            _ => Item::Value(Expr::parse(cursor)?),
        };
        items.push(item);
    }
    Ok(Instruction::Type(items))
}

fn format_item(word: &str) -> Result<Item, Fault> {
    let number = |text: &str| match text {
        "" => Some(1),
        _ => text.parse::<usize>().ok().filter(|n| *n <= 80),
    };
    let (letter, rest) = word.split_at(1);
    let item = match letter {
        "X" => number(rest).map(Item::Blanks),
        "C" => number(rest).map(Item::Lines),
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

fn prompt(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let text = match cursor.peek() {
        Some(Token::Text(text)) => {
            cursor.next();
            cursor.expect_sign(",")?;
            Some(text.clone())
        }
        _ => None,
    };
    let mut variables = vec![Variable::parse(cursor)?];
    while cursor.sign(",") {
        variables.push(Variable::parse(cursor)?);
    }
    Ok(Instruction::Prompt(text, variables))
}

fn label(cursor: &mut Cursor<'_>) -> Result<u32, Fault> {
    match cursor.next() {
        Some(Token::Number(number))
            if number.fract() == 0.0 && (0.0..=65535.0).contains(number) =>
        {
            Ok(*number as u32)
        }
        _ => Err(Message::InvalidArgument.into()),
    }
}

fn condition(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let condition = Expr::parse(cursor)?;
    if cursor.word("THEN") {
        return Ok(Instruction::IfThen(condition));
    }
    cursor.expect_word("GOTO")?;
    Ok(Instruction::IfGoto(condition, label(cursor)?))
}

fn for_loop(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let variable = Variable::parse(cursor)?;
    cursor.expect_sign("=")?;
    let from = Expr::parse(cursor)?;
    cursor.expect_word("TO")?;
    let to = Expr::parse(cursor)?;
    let step = if cursor.word("STEP") {
        Some(Expr::parse(cursor)?)
    } else {
        None
    };
    Ok(Instruction::For {
        variable,
        from,
        to,
        step,
    })
}

fn while_loop(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let condition = Expr::parse(cursor)?;
    cursor.expect_word("DO")?;
    Ok(Instruction::While(condition))
}

fn case(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let of = Expr::parse(cursor)?;
    cursor.expect_word("OF")?;
    Ok(Instruction::Case(of))
}

fn value(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let values = expressions(cursor)?;
    cursor.sign(":");
    Ok(Instruction::Value(values))
}
