//! A line of VAL II cut into words, numbers, texts and signs.

use crate::emulator::message::{Fault, Message};

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Token {
    /// Name or keyword, upper case.
    Name(String),
    Number(f64),
    Text(String),
    Sign(&'static str),
}

/// Greatest number that a variable holds; VAL's reals have single precision.
pub(crate) const GREATEST: f64 = 1e38;

const SIGNS: [&str; 20] = [
    "==", "<>", "<=", ">=", "=<", "=>", "<", ">", "=", "+", "-", "*", "/", "^", "(", ")", "[", "]",
    ":", ",",
];

/// Cuts a line into tokens and drops a comment after `;`.
pub(crate) fn tokens(line: &str) -> Result<Vec<Token>, Fault> {
    let mut found = Vec::new();
    let mut rest = line.trim_start();
    while let Some(first) = rest.chars().next() {
        match first {
            ';' => break,
            '"' => {
                let inner = &rest[1..];
                let end = inner.find('"').ok_or(Message::InvalidArgument)?;
                found.push(Token::Text(inner[..end].to_owned()));
                rest = &inner[end + 1..];
            }
            c if c.is_ascii_digit()
                || (c == '.' && rest[1..].starts_with(|d: char| d.is_ascii_digit())) =>
            {
                let end = number_length(rest);
                let number: f64 = rest[..end].parse().map_err(|_| Message::InvalidArgument)?;
                if number > GREATEST {
                    return Err(Message::InvalidArgument.into());
                }
                found.push(Token::Number(number));
                rest = &rest[end..];
            }
            c if c.is_ascii_alphabetic() => {
                let end = rest
                    .find(|d: char| !(d.is_ascii_alphanumeric() || d == '.' || d == '_'))
                    .unwrap_or(rest.len());
                found.push(Token::Name(rest[..end].to_ascii_uppercase()));
                rest = &rest[end..];
            }
            '#' => {
                found.push(Token::Sign("#"));
                rest = &rest[1..];
            }
            _ => {
                let sign = SIGNS
                    .into_iter()
                    .find(|s| rest.starts_with(s))
                    .ok_or(Message::InvalidArgument)?;
                found.push(Token::Sign(sign));
                rest = &rest[sign.len()..];
            }
        }
        rest = rest.trim_start();
    }
    Ok(found)
}

/// Returns the first word of a line that has a character in it that no token has, or the quote
/// that does not end.
pub(crate) fn strange_word(line: &str) -> String {
    let known = |c: char| c.is_ascii_alphanumeric() || " _.;\"#".contains(c);
    let strange = |c: char| !known(c) && SIGNS.iter().all(|sign| !sign.contains(c));
    let open = line.matches('"').count() % 2 == 1;
    let quote = line.rfind('"').filter(|_| open).map(|at| &line[at..]);
    let mut words = line.split([' ', ',', '(', ')']);
    let word = words.find(|word| word.contains(strange)).or(quote);
    word.unwrap_or_default().to_owned()
}

/// Returns the length of the number that a text begins with, an exponent with digits included.
fn number_length(text: &str) -> usize {
    let end = |from: usize, part: fn(char) -> bool| {
        let length = text[from..].find(|c| !part(c));
        length.map_or(text.len(), |length| from + length)
    };
    let whole = end(0, |c| c.is_ascii_digit() || c == '.');
    let exponent = text[whole..].strip_prefix(['E', 'e']);
    let digits = exponent.map(|e| text.len() - e.strip_prefix(['+', '-']).unwrap_or(e).len());
    match digits.map(|from| (from, end(from, |c| c.is_ascii_digit()))) {
        Some((from, end)) if end > from => end,
        _ => whole,
    }
}

/// Reader over the tokens of a line.
#[derive(Clone, Debug)]
pub(crate) struct Cursor<'a> {
    tokens: &'a [Token],
    depth: usize,
    operators: usize,
    /// First word that is no instruction or function.
    unknown: Option<&'a str>,
}

/// Deepest nesting of brackets, signs and indices; no sensible line reaches it.
const DEPTH: usize = 24;

/// Most operators of a line. A chain of them is as deep as it is long.
const OPERATORS: usize = 128;

impl<'a> Cursor<'a> {
    pub(crate) fn new(tokens: &'a [Token]) -> Self {
        Self {
            tokens,
            depth: 0,
            operators: 0,
            unknown: None,
        }
    }

    pub(crate) fn peek(&self) -> Option<&'a Token> {
        self.tokens.first()
    }

    pub(crate) fn peek_second(&self) -> Option<&'a Token> {
        self.tokens.get(1)
    }

    pub(crate) fn next(&mut self) -> Option<&'a Token> {
        let (first, rest) = self.tokens.split_first()?;
        self.tokens = rest;
        Some(first)
    }

    pub(crate) fn at_end(&self) -> bool {
        self.tokens.is_empty()
    }

    /// Takes the sign if it comes next.
    pub(crate) fn sign(&mut self, sign: &str) -> bool {
        let is_next = matches!(self.peek(), Some(Token::Sign(s)) if *s == sign);
        is_next && self.next().is_some()
    }

    /// Takes the word if it comes next.
    pub(crate) fn word(&mut self, word: &str) -> bool {
        let is_next = matches!(self.peek(), Some(Token::Name(n)) if n == word);
        is_next && self.next().is_some()
    }

    pub(crate) fn expect_sign(&mut self, sign: &str) -> Result<(), Fault> {
        expected(self.sign(sign))
    }

    pub(crate) fn expect_word(&mut self, word: &str) -> Result<(), Fault> {
        expected(self.word(word))
    }

    pub(crate) fn expect_end(&self) -> Result<(), Fault> {
        expected(self.at_end())
    }

    pub(crate) fn name(&mut self) -> Result<String, Fault> {
        match self.next() {
            Some(Token::Name(name)) => Ok(name.clone()),
            _ => Err(Message::InvalidArgument.into()),
        }
    }

    /// Takes a text in quotes if it comes next.
    pub(crate) fn text(&mut self) -> Option<String> {
        let Some(Token::Text(text)) = self.peek() else {
            return None;
        };
        self.next();
        Some(text.clone())
    }

    /// Parses one item or more between commas.
    pub(crate) fn list<T>(
        &mut self,
        item: impl Fn(&mut Self) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let mut found = vec![item(self)?];
        while self.sign(",") {
            found.push(item(self)?);
        }
        Ok(found)
    }

    /// Parses an item if `sign` comes before it.
    pub(crate) fn after_sign<T>(
        &mut self,
        sign: &str,
        item: impl Fn(&mut Self) -> Result<T, Fault>,
    ) -> Result<Option<T>, Fault> {
        self.sign(sign).then(|| item(self)).transpose()
    }

    /// Parses an item if anything is left.
    pub(crate) fn rest<T>(
        &mut self,
        item: impl Fn(&mut Self) -> Result<T, Fault>,
    ) -> Result<Option<T>, Fault> {
        (!self.at_end()).then(|| item(self)).transpose()
    }

    /// Remembers a word that is not understood and returns the fault.
    pub(crate) fn unknown_word(&mut self, word: &'a str) -> Fault {
        self.unknown.get_or_insert(word);
        Message::InvalidArgument.into()
    }

    /// Returns the first word that is not understood, or the one where the line ceased to be.
    pub(crate) fn culprit(&self) -> String {
        match (self.unknown, self.peek()) {
            (Some(word), _) => word.to_owned(),
            (None, Some(Token::Name(word))) => word.clone(),
            _ => String::new(),
        }
    }

    /// Goes one bracket deeper.
    pub(crate) fn descend(&mut self) -> Result<(), Fault> {
        self.depth += 1;
        expected(self.depth <= DEPTH)
    }

    /// Takes an operator, which makes what is parsed one deeper.
    pub(crate) fn operator(&mut self) -> Result<(), Fault> {
        self.next();
        self.operators += 1;
        expected(self.operators <= OPERATORS)
    }

    pub(crate) fn ascend(&mut self) {
        self.depth -= 1;
    }
}

fn expected(is_so: bool) -> Result<(), Fault> {
    is_so.then_some(()).ok_or(Message::InvalidArgument.into())
}

/// Returns the only entry of `words` that `typed` names or abbreviates.
pub(crate) fn keyword<'a, T>(
    typed: &str,
    words: &'a [(&str, T)],
    unknown: Message,
) -> Result<&'a T, Fault> {
    if let Some((_, found)) = words.iter().find(|(word, _)| *word == typed) {
        return Ok(found);
    }
    let mut matching = words.iter().filter(|(word, _)| word.starts_with(typed));
    match (matching.next(), matching.next()) {
        (Some((_, found)), None) => Ok(found),
        (None, _) => Err(unknown.into()),
        _ => Err(Message::AmbiguousName.into()),
    }
}
