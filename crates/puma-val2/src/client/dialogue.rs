//! Questions of the controller, and the bytes that leave a dialogue or a half-typed line.

/// Deletes a half-typed line, or spoils it where Ctrl-U is unknown, so that it cannot be carried
/// out. Ctrl-Q comes first: a flipped bit can make a Ctrl-S, which holds all output.
pub(super) const SPOIL: &[u8] = b"\x11\x15!!\r";

/// Stops the arm and a program, without a prompt. The first `PANIC` may be appended to a half-typed
/// line, which it makes invalid.
pub(super) const STOP: &[u8] = b"\x11PANIC\rPANIC\r\x03";

/// Asks for the prompt.
pub(super) const NUDGE: &[u8] = b"\x11\r";

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

/// Returns `true` for a text that is nothing but the echo of [`SPOIL`].
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
