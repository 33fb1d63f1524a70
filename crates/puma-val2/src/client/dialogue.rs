//! States of the line, and the bytes that answer silence and questions in them.

use crate::client::reader::Ending;

/// State of the line to the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// A line may be open: its characters have been sent, or nothing is certain.
    Open,
    /// The end of a line has been sent, its echo has not come.
    Ended,
    /// The end has come back, or nothing is echoed. The reply has not ended.
    Replying,
    /// The reply has ended with a prompt or a question.
    Asking(Ending),
}

/// Task of the client at which silence is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// A line of the client's own, at a monitor that is known.
    Session,
    /// The search for a prompt. Somebody else may have typed half a line.
    Connecting,
    /// A stop, while the arm may move.
    Stopping,
    /// A program of the user runs and may ask for values.
    Program,
}

/// Deletes an open line, or spoils it where Ctrl-U is unknown, so that it cannot be carried out.
/// Ctrl-Q comes first: a flipped bit can make a Ctrl-S, which holds all output.
pub(crate) const SPOIL: &[u8] = b"\x11\x15!!\r";

/// Returns the bytes that are sent after silence: the only ones that no caller has asked for.
///
/// | state | mode | sent | reason |
/// |---|---|---|---|
/// | open, ended | any | Ctrl-U `!!` CR | a bare CR would carry out a damaged line |
/// | replying | session | CR | asks for a lost prompt; a busy controller answers later |
/// | replying | connecting | Ctrl-U `!!` CR | the open line may be another user's |
/// | replying | stopping | `PANIC` CR | every repetition stops |
/// | replying | program | nothing | the program may take a CR for an answer |
/// | asking | any | nothing | the reply is complete |
///
/// Without an echo *ended* is never seen, and the CR of *replying* may end a damaged line. There
/// the client moves the arm by `READY`, or by a program whose listing has been compared.
pub(super) fn at_silence(state: State, mode: Mode) -> &'static [u8] {
    match (state, mode) {
        (State::Open | State::Ended, _) | (State::Replying, Mode::Connecting) => SPOIL,
        (State::Replying, Mode::Session) => b"\x11\r",
        (State::Replying, Mode::Stopping) => b"PANIC\r",
        (State::Replying, Mode::Program) | (State::Asking(_), _) => b"",
    }
}

/// Stops the arm and a program, without a prompt. The first `PANIC` may be appended to an open
/// line, which it makes invalid.
pub(super) const STOP: &[u8] = b"\x11PANIC\rPANIC\r\x03";

/// Cancels a dialogue, where control characters are known.
pub(super) const CANCEL: &[u8] = b"\x03";

/// Question of the resident program.
pub(super) const RESIDENT_QUESTION: &str = "GO? ";

/// Line that ends the resident program.
pub(super) const RESIDENT_LEAVE: &[u8] = b"914\r";

/// Returns `true` if the last question of a text belongs to the start-up dialogue.
pub(super) fn is_boot_question(text: &str) -> bool {
    let question = last_question(text);
    question.contains("(Y/N)") && (question.contains("LOAD") || question.contains("INIT"))
}

/// Returns the bytes that leave a dialogue; attempts take turns.
///
/// An empty line ends questions for changes and for yes and no. An unknown question may come from a
/// program that would take an empty line for zeros, so it is cancelled first.
pub(super) fn way_out(text: &str, attempt: usize) -> &'static [u8] {
    let question = last_line(text).to_ascii_uppercase();
    let words = question.trim_end_matches(['?', ' ']);
    let of_editor = words.trim_end_matches('.').trim().parse::<u32>().is_ok();
    let yes_or_no = question.contains("Y/N");
    let first = attempt.is_multiple_of(2);
    if question.starts_with(RESIDENT_QUESTION.trim_end()) {
        RESIDENT_LEAVE
    } else if of_editor {
        if first { b"\r" } else { b"E\r" }
    } else if yes_or_no {
        if first { b"\r" } else { b"N\r" }
    } else if first != question.contains("CHANGE") {
        CANCEL
    } else {
        b"\r"
    }
}

/// Returns the last question of a text, in upper case and without its mark. Without an echo one
/// question can follow another on its line.
pub(super) fn last_question(text: &str) -> String {
    let line = last_line(text).trim_end_matches(['?', ' ']);
    line.rsplit('?')
        .next()
        .unwrap_or_default()
        .to_ascii_uppercase()
}

pub(super) fn last_line(text: &str) -> &str {
    text.trim_end()
        .rsplit(['\r', '\n'])
        .next()
        .unwrap_or_default()
}

/// Returns `true` for a text that is nothing but the echo of a spoilt line.
pub(super) fn is_own_echo(text: &str) -> bool {
    let echo = |c: char| c.is_whitespace() || "!^UQ".contains(c);
    text.contains('!') && text.chars().all(echo)
}

/// Returns the end of a text, short enough for a message and without blank lines.
pub(super) fn shortened(text: &str) -> String {
    let mut lines: Vec<&str> = text.split(['\r', '\n']).collect();
    lines.dedup();
    let text = lines.join("\r\n");
    let count = text.chars().count();
    if count <= 120 {
        text.to_owned()
    } else {
        format!("...{}", text.chars().skip(count - 117).collect::<String>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_line_is_never_answered_by_a_bare_line_end() {
        for mode in [
            Mode::Session,
            Mode::Connecting,
            Mode::Stopping,
            Mode::Program,
        ] {
            for state in [State::Open, State::Ended] {
                assert_eq!(at_silence(state, mode), SPOIL);
            }
            let complete = State::Asking(Ending::Question);
            assert_eq!(at_silence(complete, mode), b"");
        }
    }
}
