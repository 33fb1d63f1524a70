//! Program instructions and their parser.

use crate::emulator::language::argument::{Argument, arguments_of_call};
use crate::emulator::language::expr::{Expr, Variable};
use crate::emulator::language::item::Item;
use crate::emulator::language::lexer::{Cursor, Token, keyword};
use crate::emulator::language::place_expr::{PlaceExpr, PlaceName, arguments};
use crate::emulator::language::program::local_name;
use crate::emulator::message::{Fault, Message};
use crate::manipulator::Gripper;

#[derive(Clone, Debug)]
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
    /// A word of posture: the part of the `Configuration` and its value.
    Posture(usize, bool),
    /// `GRASP`: closes the hand. Where it closes on nothing, narrower than asked, a label follows.
    Grasp(Option<Expr>, Option<u32>),
    /// `TIMER n = seconds`.
    Timer(Expr, Expr),
    Parameter(String, Expr),
    Switch(Vec<String>, bool),
    /// `RUNSIG`: this output is on while the program runs.
    RunSignal(Expr),
    /// `EXIT`: behind the loop. `NEXT`: to the loop's end.
    LeaveLoop,
    NextTurn,
    Speed {
        value: Expr,
        unit: SpeedUnit,
        always: bool,
    },
    /// `NULL`, `NONULL`, `INTON`, `INTOFF`, `LOCK`: accepted; the emulated servos settle exactly.
    Accepted,
    /// `FINE` and `COARSE`: the arm stands at the end of the next motion or, with `ALWAYS`, of
    /// every motion; or it does not.
    Fine(bool, bool),
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
    /// A location, or a compound whose last part is defined.
    Here(Vec<PlaceName>),
    Decompose(Variable, PlaceExpr),
    Tool(Option<PlaceExpr>),
    Base([Option<Expr>; 4]),
    Type(Vec<Item>),
    Prompt(Option<String>, Vec<Variable>),
    Goto(u32),
    IfGoto(Expr, u32),
    IfThen(Expr),
    /// `ELSE`, or `ELSE IF` with a condition.
    Else(Option<Expr>),
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
    Call(String, Vec<Argument>),
    /// `AUTO`, `LOCAL`: variables and locations of this call alone.
    Local(Vec<String>),
    /// `REACTE`: the program to call after a fault.
    OnFault(Option<String>),
    /// `RETURN`: the caller leaves out this many steps.
    Return(u32),
    /// `PAUSE` and `STOP`, with a text to print.
    Pause(Option<String>),
    Stop(Option<String>),
    Halt,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SpeedUnit {
    Percent,
    MillimetresPerSecond,
    InchesPerSecond,
}

#[derive(Debug)]
enum Word {
    Plain(Instruction),
    Parse(fn(&mut Cursor<'_>) -> Result<Instruction, Fault>),
}

use Instruction as I;
use Word::{Parse, Plain};

static WORDS: [(&str, Word); 76] = [
    ("ABOVE", Plain(I::Posture(1, true))),
    ("ALIGN", Plain(I::Align)),
    ("ANY", Plain(I::Any)),
    ("APPRO", Parse(|c| appro(c, false))),
    ("APPROS", Parse(|c| appro(c, true))),
    ("AUTO", Parse(|c| c.list(local_name).map(I::Local))),
    ("BASE", Parse(|c| arguments(c).map(I::Base))),
    ("BELOW", Plain(I::Posture(1, false))),
    ("BREAK", Plain(I::Break)),
    (
        "CALL",
        Parse(|c| Ok(I::Call(c.name()?, arguments_of_call(c)?))),
    ),
    ("CASE", Parse(case)),
    ("CLOSE", Parse(|c| hand(c, Gripper::Closed, false))),
    ("CLOSEI", Parse(|c| hand(c, Gripper::Closed, true))),
    ("COARSE", Parse(|c| Ok(I::Fine(false, c.word("ALWAYS"))))),
    ("DECOMPOSE", Parse(decompose)),
    ("DELAY", Parse(|c| Expr::parse(c).map(I::Delay))),
    ("DEPART", Parse(|c| depart(c, false))),
    ("DEPARTS", Parse(|c| depart(c, true))),
    ("DISABLE", Parse(|c| switch(c, false))),
    ("DO", Plain(I::Do)),
    ("DRAW", Parse(|c| arguments(c).map(I::Draw))),
    ("DRIVE", Parse(drive)),
    ("ELSE", Parse(|c| c.rest(else_if).map(I::Else))),
    ("ENABLE", Parse(|c| switch(c, true))),
    ("END", Plain(I::End)),
    ("EXIT", Plain(I::LeaveLoop)),
    ("FINE", Parse(|c| Ok(I::Fine(true, c.word("ALWAYS"))))),
    ("FLIP", Plain(I::Posture(2, true))),
    ("FOR", Parse(for_loop)),
    ("GLOBAL", Parse(|c| c.list(local_name).map(|_| I::Accepted))),
    ("GOTO", Parse(|c| label(c).map(I::Goto))),
    ("GRASP", Parse(grasp)),
    ("HALT", Plain(I::Halt)),
    ("HERE", Parse(|c| PlaceName::parse_compound(c).map(I::Here))),
    ("IF", Parse(condition)),
    ("IGNORE", Parse(ignore)),
    ("INTOFF", Parse(settling)),
    ("INTON", Parse(settling)),
    ("LEFTY", Plain(I::Posture(0, false))),
    ("LOCAL", Parse(|c| c.list(local_name).map(I::Local))),
    ("LOCK", Parse(|c| Expr::parse(c).map(|_| I::Accepted))),
    ("MOVE", Parse(|c| motion(c, false, false))),
    ("MOVES", Parse(|c| motion(c, true, false))),
    ("MOVEST", Parse(|c| motion(c, true, true))),
    ("MOVET", Parse(|c| motion(c, false, true))),
    ("NEST", Plain(I::Nest)),
    ("NEXT", Plain(I::NextTurn)),
    ("NOFLIP", Plain(I::Posture(2, false))),
    ("NONULL", Parse(settling)),
    ("NULL", Parse(settling)),
    ("OPEN", Parse(|c| hand(c, Gripper::Open, false))),
    ("OPENI", Parse(|c| hand(c, Gripper::Open, true))),
    ("PARAMETER", Parse(parameter)),
    ("PAUSE", Parse(|c| Ok(I::Pause(c.text())))),
    ("PROMPT", Parse(prompt)),
    ("REACT", Parse(|c| react(c, false))),
    ("REACTE", Parse(|c| c.rest(Cursor::name).map(I::OnFault))),
    ("REACTI", Parse(|c| react(c, true))),
    ("READY", Plain(I::Ready)),
    ("RELAX", Parse(|c| hand(c, Gripper::Open, false))),
    ("RELAXI", Parse(|c| hand(c, Gripper::Open, true))),
    ("RESET", Plain(I::Reset)),
    (
        "RETURN",
        Parse(|c| c.rest(label).map(|skip| I::Return(skip.unwrap_or(0)))),
    ),
    ("RIGHTY", Plain(I::Posture(0, true))),
    ("RUNSIG", Parse(|c| Expr::parse(c).map(I::RunSignal))),
    ("SET", Parse(set)),
    ("SIGNAL", Parse(|c| Expr::parse_list(c).map(I::Signal))),
    ("SPEED", Parse(speed)),
    ("STOP", Parse(|c| Ok(I::Stop(c.text())))),
    ("TIMER", Parse(timer)),
    ("TOOL", Parse(|c| c.rest(PlaceExpr::parse).map(I::Tool))),
    ("TYPE", Parse(print)),
    ("UNTIL", Parse(|c| Expr::parse(c).map(I::Until))),
    ("VALUE", Parse(value)),
    ("WAIT", Parse(wait)),
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
        let assigns = matches!(cursor.peek_second(), Some(Token::Sign("=" | "[")));
        let instruction = if assigns {
            let variable = Variable::parse(cursor)?;
            cursor.expect_sign("=")?;
            Self::Assign(variable, Expr::parse(cursor)?)
        } else {
            cursor.next();
            let word = keyword(name, &WORDS, Message::UnknownInstruction);
            if word.is_err() {
                cursor.unknown_word(name);
            }
            match word? {
                Plain(instruction) => instruction.clone(),
                Parse(parse) => parse(cursor)?,
            }
        };
        cursor.expect_end()?;
        Ok(instruction)
    }

    /// Returns `true` for the first word of a structure that `END` or `UNTIL` closes.
    pub(crate) fn opens(&self) -> bool {
        matches!(
            self,
            Self::IfThen(_) | Self::For { .. } | Self::While(_) | Self::Do | Self::Case(_)
        )
    }

    /// Returns `true` for the last word of a structure.
    pub(crate) fn closes(&self) -> bool {
        matches!(self, Self::End | Self::Until(_))
    }

    /// Returns `true` if the instruction makes sense only among the steps of a program.
    pub(crate) fn needs_program(&self) -> bool {
        let branches = matches!(
            self,
            Self::Goto(_)
                | Self::IfGoto(..)
                | Self::Else(_)
                | Self::Value(_)
                | Self::Any
                | Self::LeaveLoop
                | Self::NextTurn
                | Self::Local(_)
                | Self::OnFault(_)
        );
        let ends = matches!(
            self,
            Self::Return(_) | Self::Pause(_) | Self::Stop(_) | Self::Halt
        );
        self.opens() || self.closes() || branches || ends
    }
}

fn appro(cursor: &mut Cursor<'_>, straight: bool) -> Result<Instruction, Fault> {
    let to = PlaceExpr::parse(cursor)?;
    cursor.expect_sign(",")?;
    let distance = Expr::parse(cursor)?;
    Ok(I::Appro {
        straight,
        to,
        distance,
    })
}

fn depart(cursor: &mut Cursor<'_>, straight: bool) -> Result<Instruction, Fault> {
    let distance = Expr::parse(cursor)?;
    Ok(I::Depart { straight, distance })
}

fn drive(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let three = Expr::parse_list(cursor)?.try_into();
    three
        .map(I::Drive)
        .map_err(|_| Message::InvalidArgument.into())
}

fn motion(cursor: &mut Cursor<'_>, straight: bool, with_hand: bool) -> Result<Instruction, Fault> {
    let to = PlaceExpr::parse(cursor)?;
    let hand = if with_hand {
        cursor.expect_sign(",")?;
        Some(Expr::parse(cursor)?)
    } else {
        None
    };
    Ok(I::Move { straight, to, hand })
}

fn hand(cursor: &mut Cursor<'_>, to: Gripper, at_once: bool) -> Result<Instruction, Fault> {
    // A servoed hand takes an opening in millimetres; the emulated one is pneumatic and only checks
    // that it is a number.
    Expr::parse_optional(cursor)?;
    Ok(I::Hand { to, at_once })
}

fn grasp(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let opening = Expr::parse_optional(cursor)?;
    Ok(I::Grasp(opening, cursor.after_sign(",", label)?))
}

fn timer(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    // `=` compares inside an expression.
    let number = match cursor.next() {
        Some(Token::Number(number)) => Expr::Number(*number),
        Some(Token::Name(name)) => Expr::Variable(Variable {
            name: name.clone(),
            index: Box::default(),
        }),
        _ => return Err(Message::InvalidArgument.into()),
    };
    cursor.expect_sign("=")?;
    Ok(I::Timer(number, Expr::parse(cursor)?))
}

fn parameter(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let name = cursor.name()?;
    cursor.expect_sign("=")?;
    Ok(I::Parameter(name, Expr::parse(cursor)?))
}

fn switch(cursor: &mut Cursor<'_>, on: bool) -> Result<Instruction, Fault> {
    Ok(I::Switch(cursor.list(Cursor::name)?, on))
}

fn ignore(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let signal = Expr::parse(cursor)?;
    cursor.word("ALWAYS");
    Ok(I::Ignore(signal))
}

/// Parses a condition; a number alone is that of a signal.
fn wait(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let condition = Expr::parse(cursor)?;
    let is_number = match &condition {
        Expr::Number(_) => true,
        Expr::Negate(inner) => matches!(**inner, Expr::Number(_)),
        _ => false,
    };
    Ok(I::Wait(if is_number {
        Expr::Signals(vec![condition])
    } else {
        condition
    }))
}

fn settling(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    cursor.word("ALWAYS");
    Ok(I::Accepted)
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
    let always = cursor.word("ALWAYS");
    Ok(I::Speed {
        value,
        unit,
        always,
    })
}

fn react(cursor: &mut Cursor<'_>, at_once: bool) -> Result<Instruction, Fault> {
    let signal = Expr::parse(cursor)?;
    let mut program = None;
    if cursor.sign(",") {
        if let Some(Token::Name(_)) = cursor.peek() {
            program = Some(cursor.name()?);
        }
        // The priority orders reactions among each other; only one is served at a time here.
        cursor.after_sign(",", Expr::parse_optional)?;
    }
    cursor.word("ALWAYS");
    Ok(I::React {
        at_once,
        signal,
        program,
    })
}

fn set(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let name = PlaceName::parse(cursor)?;
    cursor.expect_sign("=")?;
    Ok(I::SetPlace(name, PlaceExpr::parse(cursor)?))
}

fn decompose(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let mut into = Variable {
        name: cursor.name()?,
        index: Box::default(),
    };
    // Empty brackets begin at element 0.
    if cursor.sign("[") && !cursor.sign("]") {
        into.index = Box::new([Expr::parse(cursor)?]);
        cursor.expect_sign("]")?;
    }
    cursor.expect_sign("=")?;
    Ok(I::Decompose(into, PlaceExpr::parse(cursor)?))
}

fn print(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let items = cursor.rest(|cursor| cursor.list(Item::parse))?;
    Ok(I::Type(items.unwrap_or_default()))
}

fn prompt(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let text = cursor.text();
    if text.is_some() {
        cursor.expect_sign(",")?;
    }
    Ok(I::Prompt(text, cursor.list(Variable::parse)?))
}

/// Parses the number of a step.
pub(crate) fn label(cursor: &mut Cursor<'_>) -> Result<u32, Fault> {
    match cursor.next() {
        Some(Token::Number(n)) if n.fract() == 0.0 && (0.0..=65535.0).contains(n) => Ok(*n as u32),
        _ => Err(Message::InvalidArgument.into()),
    }
}

fn condition(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let condition = Expr::parse(cursor)?;
    if cursor.word("THEN") {
        return Ok(I::IfThen(condition));
    }
    cursor.expect_word("GOTO")?;
    Ok(I::IfGoto(condition, label(cursor)?))
}

fn else_if(cursor: &mut Cursor<'_>) -> Result<Expr, Fault> {
    cursor.expect_word("IF")?;
    let condition = Expr::parse(cursor)?;
    cursor.expect_word("THEN")?;
    Ok(condition)
}

fn for_loop(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let variable = Variable::parse(cursor)?;
    cursor.expect_sign("=")?;
    let from = Expr::parse(cursor)?;
    cursor.expect_word("TO")?;
    let to = Expr::parse(cursor)?;
    let step = cursor.word("STEP").then(|| Expr::parse(cursor));
    Ok(I::For {
        variable,
        from,
        to,
        step: step.transpose()?,
    })
}

fn while_loop(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let condition = Expr::parse(cursor)?;
    cursor.expect_word("DO")?;
    Ok(I::While(condition))
}

fn case(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let of = Expr::parse(cursor)?;
    cursor.expect_word("OF")?;
    Ok(I::Case(of))
}

fn value(cursor: &mut Cursor<'_>) -> Result<Instruction, Fault> {
    let values = Expr::parse_list(cursor)?;
    cursor.sign(":");
    Ok(I::Value(values))
}
