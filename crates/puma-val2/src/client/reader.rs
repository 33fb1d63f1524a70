//! Replies of the controller: where they end and what they say.

/// End of a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// Prompt of an idle monitor.
    Idle,
    /// Prompt of a monitor while a program runs.
    Running,
    /// A question.
    Question,
}

/// Collects bytes until they can be a whole reply. No time passes in here: a caller that sees an
/// [`Ending`] must still wait for silence, for a `.` at the start of a line may be the beginning of
/// something.
#[derive(Clone, Debug)]
pub(crate) struct ReplyReader {
    text: String,
    limit: usize,
    idle_prompt: char,
    run_prompt: char,
    overflowed: bool,
}

impl ReplyReader {
    /// A reader for replies of up to `limit` bytes.
    pub(crate) fn new(limit: usize, idle_prompt: char, run_prompt: char) -> Self {
        Self {
            text: String::new(),
            limit,
            idle_prompt,
            run_prompt,
            overflowed: false,
        }
    }

    /// Adds bytes. Of what exceeds the limit the older half is forgotten, so that the end is still
    /// found.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            match byte {
                b'\r' | b'\n' | b'\t' | 0x20..=0x7e => self.text.push(byte as char),
                0x80.. => self.text.push(char::REPLACEMENT_CHARACTER),
                _ => {}
            }
        }
        if self.text.len() > self.limit {
            self.overflowed = true;
            let mut from = self.text.len() - self.limit / 2;
            while !self.text.is_char_boundary(from) {
                from += 1;
            }
            self.text.drain(..from);
        }
    }

    /// Returns `true` if more has come than is kept.
    pub(crate) fn overflowed(&self) -> bool {
        self.overflowed
    }

    /// Returns the text that has come so far.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// Returns the end of the reply, if nothing more comes.
    pub(crate) fn ending(&self) -> Option<Ending> {
        let last_line = self
            .text
            .rsplit(['\r', '\n'])
            .next()
            .unwrap_or_default()
            .trim();
        let mut characters = last_line.chars();
        match (characters.next(), characters.next()) {
            (Some(c), None) if c == self.idle_prompt => Some(Ending::Idle),
            (Some(c), None) if c == self.run_prompt => Some(Ending::Running),
            _ if self.text.trim_end().ends_with('?') => Some(Ending::Question),
            _ => None,
        }
    }
}

/// The controller's messages in a reply: the text between asterisks, and what follows it on the
/// line (` Jt 1`).
pub(super) fn messages(reply: &str) -> Vec<String> {
    reply
        .split(['\r', '\n'])
        .filter_map(|line| {
            let inner = line.trim().trim_start_matches('.').strip_prefix('*')?;
            let (message, rest) = inner.trim_start_matches('*').split_once('*')?;
            let message = format!("{}{}", message.trim(), rest.trim_end());
            (!message.is_empty()).then_some(message)
        })
        .collect()
}

/// Returns the lines that a reply says, without blank ones, the echo of `line` and the prompt.
pub(super) fn lines_said(reply: &str, line: &str) -> Vec<String> {
    let mut lines: Vec<&str> = reply.split(['\r', '\n']).map(str::trim_end).collect();
    // The prompt or the question.
    lines.pop();
    let is_echo = |l: &&str| {
        l.trim()
            .trim_start_matches(['.', '*'])
            .eq_ignore_ascii_case(line.trim())
    };
    let echo = lines.iter().position(is_echo);
    lines.drain(..echo.map_or(0, |at| at + 1));
    let said = lines.into_iter().filter(|line| !line.is_empty());
    said.map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ending(text: &str) -> Option<Ending> {
        let mut reader = ReplyReader::new(1000, '.', '*');
        reader.push(text.as_bytes());
        reader.ending()
    }

    #[test]
    fn a_prompt_is_one_only_at_the_start_of_a_line() {
        assert_eq!(ending("SPEED 50\r\n."), Some(Ending::Idle));
        assert_eq!(ending("."), Some(Ending::Idle));
        assert_eq!(ending("SPEED 50."), None);
        assert_eq!(ending("\r\n  10."), None);
        assert_eq!(ending("\r\n*"), Some(Ending::Running));
        assert_eq!(ending("\r\n*Arm power off*"), None);
        assert_eq!(ending("Change?\r\n"), Some(Ending::Question));
        assert_eq!(ending("Initialize (Y/N)? "), Some(Ending::Question));
    }

    #[test]
    fn messages_stand_between_asterisks() {
        let reply = "DO DRIVE 1,200,100\r\n*Location out of range* Jt 1\r\n.";
        assert_eq!(messages(reply), ["Location out of range Jt 1"]);
        assert_eq!(messages("2*3*4\r\n*\r\n."), Vec::<String>::new());
    }

    #[test]
    fn a_reply_without_end_stays_within_its_limit() {
        let mut reader = ReplyReader::new(1000, '.', '*');
        for piece in 0..=255 {
            reader.push(&[piece; 333]);
            assert!(reader.text().len() <= 1000 + 3 * 333);
            let _ = reader.ending();
        }
        reader.push(b"\r\n.");
        assert!(reader.text().len() <= 1000 && reader.overflowed());
        assert_eq!(reader.ending(), Some(Ending::Idle));
    }
}
