//! Service on a pseudo-terminal.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, PipeReader, PipeWriter, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl, open};
use rustix::io::{FdFlags, fcntl_setfd};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use crate::serve::station::Station;

/// Most output that waits for a terminal that does not read; older output is dropped beyond it.
const PENDING_LIMIT: usize = 256 * 1024;

/// Means of waking and ending the thread.
#[derive(Debug)]
pub(super) struct Closing {
    path: PathBuf,
    link: Option<PathBuf>,
    wake: PipeWriter,
}

impl Closing {
    /// Makes the thread look at the emulator, which may have something to say.
    pub(super) fn wake(&self) {
        let _ = (&self.wake).write(&[0]);
    }

    /// Ends the thread and removes the link.
    pub(super) fn end(&self) {
        let _ = (&self.wake).write(&[1]);
        if let Some(link) = &self.link
            && fs::read_link(link).is_ok_and(|to| to == self.path)
        {
            let _ = fs::remove_file(link);
        }
    }
}

/// Opens a pseudo-terminal and serves the emulator on it.
pub(super) fn spawn(
    station: &Station,
    link: Option<PathBuf>,
) -> io::Result<(PathBuf, Closing, JoinHandle<()>)> {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    // Not every system opens a pseudo-terminal with this flag.
    fcntl_setfd(&master, FdFlags::CLOEXEC)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let name = ptsname(&master, Vec::new())?;
    let path = PathBuf::from(OsStr::from_bytes(name.to_bytes()));
    // While the terminal's side is held open, a client that closes it does not break the line.
    let held = open(
        &path,
        OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC,
        Mode::empty(),
    )?;
    let mut attributes = tcgetattr(&held)?;
    attributes.make_raw();
    tcsetattr(&held, OptionalActions::Now, &attributes)?;
    fcntl_setfl(&master, fcntl_getfl(&master)? | OFlags::NONBLOCK)?;
    if let Some(link) = &link {
        replace_link(&path, link)?;
    }
    let (woken, wake) = io::pipe()?;
    let thread = std::thread::Builder::new().name("val2-pty".into()).spawn({
        let station = station.clone();
        move || serve(&station, File::from(master), held, woken)
    })?;
    let closing = Closing {
        path: path.clone(),
        link,
        wake,
    };
    Ok((path, closing, thread))
}

/// Makes `link` point to `path` in one step. It replaces nothing but another link.
fn replace_link(path: &Path, link: &Path) -> io::Result<()> {
    if let Ok(there) = fs::symlink_metadata(link)
        && !there.file_type().is_symlink()
    {
        let what = format!(
            "{} is there and is no symbolic link: choose another path",
            link.display()
        );
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, what));
    }
    let mut beside = link.as_os_str().to_owned();
    beside.push(format!(".{}", std::process::id()));
    let beside = PathBuf::from(beside);
    std::os::unix::fs::symlink(path, &beside)
        .and_then(|()| {
            fs::rename(&beside, link).inspect_err(|_| {
                let _ = fs::remove_file(&beside);
            })
        })
        .map_err(|error| {
            let what = format!("{} cannot be made a symbolic link: {error}", link.display());
            io::Error::new(error.kind(), what)
        })
}

/// Serves until the pipe says 1 or the pseudo-terminal fails.
fn serve(station: &Station, mut master: File, _held: OwnedFd, mut woken: PipeReader) {
    let mut pending: Vec<u8> = Vec::new();
    let mut input = [0; 4096];
    loop {
        let count = match master.read(&mut input) {
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => 0,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(_) => return,
        };
        let turn = station.turn(&input[..count], !pending.is_empty());
        pending.extend(turn.output);
        while !pending.is_empty() {
            match master.write(&pending) {
                Ok(0) => return,
                Ok(written) => drop(pending.drain(..written)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(_) => return,
            }
        }
        let excess = pending.len().saturating_sub(PENDING_LIMIT);
        pending.drain(..excess);
        let mut interest = PollFlags::IN;
        let mut wait = turn.wait;
        if !pending.is_empty() {
            interest |= PollFlags::OUT;
            // Virtual time stands while output waits; what comes next is for the terminal to say.
            wait = wait.filter(|w| !w.is_zero());
        }
        let timeout = wait.and_then(|w| Timespec::try_from(w).ok());
        let mut fds = [
            PollFd::from_borrowed_fd(master.as_fd(), interest),
            PollFd::from_borrowed_fd(woken.as_fd(), PollFlags::IN),
        ];
        match poll(&mut fds, timeout.as_ref()) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(_) => return,
        }
        if fds[1].revents().contains(PollFlags::IN) {
            let mut word = [0; 16];
            match woken.read(&mut word) {
                Ok(count) if count > 0 && !word[..count].contains(&1) => {}
                _ => return,
            }
        }
    }
}
