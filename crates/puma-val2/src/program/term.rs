//! A terminal of the controller.

use std::io::{self, BufRead, IsTerminal, Write};
use std::sync::mpsc::{self, TryRecvError};
use std::time::Duration;

use crate::client::ClientConfig;
use crate::client::dialogue::SPOIL;
use crate::client::reader::ReplyReader;
use crate::program::failure::Failure;
use crate::program::link::Link;
use crate::transport::Transport;

/// Passes lines to the controller and its text to the standard output, until the input ends.
///
/// A person's lines are sent at once, Ctrl-C as it is. Those of a file or a pipe wait for the
/// prompt or question before: the controller's input buffer is small.
pub(super) fn run(link: &mut Link, config: &ClientConfig) -> Result<(), Failure> {
    let (sender, lines) = mpsc::channel();
    std::thread::spawn(move || {
        let stdin = io::stdin().lock().lines();
        stdin
            .map_while(Result::ok)
            .try_for_each(|line| sender.send(line))
    });
    let by_person = io::stdin().is_terminal();
    if by_person {
        eprintln!("terminal of {}; Ctrl-D ends", link.name());
    }
    let reader = || ReplyReader::new(4096, config.idle_prompt, config.run_prompt);
    let mut said = reader();
    // Asks for the prompt. An empty line would end a line that somebody has begun, or be the answer
    // to a program's question.
    let skipped = if config.control_characters { 0 } else { 2 };
    link.send(&SPOIL[skipped..])?;
    let mut buffer = [0; 512];
    let mut ended = false;
    loop {
        let quiet = config.quiet.max(Duration::from_millis(50));
        match link.receive(&mut buffer, quiet) {
            Ok(Some(count)) => {
                said.push(&buffer[..count]);
                let text = String::from_utf8_lossy(&buffer[..count]).replace('\r', "");
                io::stdout().write_all(text.as_bytes())?;
                io::stdout().flush()?;
                continue;
            }
            Ok(None) => {}
            // Ctrl-C is for the controller.
            Err(_) if link.take_interrupt() => {
                link.send(b"\x03")?;
                continue;
            }
            Err(error) => return Err(error.into()),
        }
        let asks = said.ending().is_some();
        if ended && asks {
            return Ok(writeln!(io::stdout())?);
        }
        if !by_person && !asks {
            continue;
        }
        match lines.try_recv() {
            Ok(line) => {
                said = reader();
                link.send(format!("{line}\r").as_bytes())?;
            }
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => ended = true,
        }
    }
}
