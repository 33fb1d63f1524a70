//! Values on disk: a versioned envelope, written atomically.
//!
//! Layout, numbers little-endian: 8 bytes magic `\x89QTBL\r\n\x1a`, `u32` format version, the kind
//! and the names of the types of this crate (each a `u32` length and UTF-8), the payload (bincode's
//! standard configuration), and the CRC-32 of everything before as `u32`.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Cursor, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;
use serde::de::DeserializeOwned;

const MAGIC: [u8; 8] = *b"\x89QTBL\r\n\x1a";
/// Changes whenever a type of this crate is stored in another way.
const FORMAT: u32 = 3;
const CHECKSUM: u64 = 4;
/// Most bytes of a kind, and of the names of types.
const NAME_LIMIT: usize = 255;

/// An error of a file that could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// An error and the file that it is about.
    #[error("{}: {error}", path.display())]
    At {
        /// The file.
        path: PathBuf,
        /// The error.
        #[source]
        error: Box<FileError>,
    },
    /// The operating system refused: no such file, no permission, no space.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The bytes do not begin with the signature of this format: another kind of file, or one
    /// damaged in transfer as text.
    #[error("not a file of this format (it does not begin with its signature)")]
    Signature,
    /// A file of a later version of this crate. The number is that of its format.
    #[error("made by a later version (format {0}, read here: {FORMAT}): update this program")]
    Newer(u32),
    /// A file of an earlier version of this crate, whose contents are laid out differently.
    #[error("made by an earlier version (format {0}, read here: {FORMAT}): make it anew")]
    Older(u32),
    /// A file that is cut short or damaged: the checksum in it, and that of its bytes.
    #[error("the checksum is {0:08x} but the bytes give {1:08x}: the file is cut short or damaged")]
    Checksum(u32, u32),
    /// A sound file of another kind or of other types: those asked for, and those found.
    #[error("it holds {1:?}, not {0:?}")]
    Kind(String, String),
    /// A kind longer than 255 bytes, with its length.
    #[error("a kind of {0} bytes is longer than 255")]
    KindTooLong(usize),
    /// A payload that is not a valid value of the type asked for, for example a table with a NaN in
    /// it.
    #[error("the contents are not valid: {0}")]
    Contents(String),
    /// A value that cannot be encoded, for example one with a schedule made of a function.
    #[error("the value cannot be written: {0}")]
    Encode(String),
}

/// Writes a value to a file, which appears whole or not at all: it is written beside the target and
/// then renamed. A file has no size limit.
///
/// `kind` says what the file holds, including the version of its type where that may change
/// (`"approach-policy/1"`); [`load`] asks for the same. An existing file is replaced and keeps its
/// permissions; a device or a pipe is written to.
///
/// ```
/// use qtable::{QTable, load, save};
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let path = std::env::temp_dir().join("qtable-doc-example.qt");
///     save(&path, "table/1", &QTable::new(3, 2)?)?;
///     let table: QTable = load(&path, "table/1")?;
///     assert_eq!(table, QTable::new(3, 2)?);
///     std::fs::remove_file(path)?;
///     Ok(())
/// }
/// ```
///
/// # Errors
/// [`FileError::At`] with the path and the cause.
pub fn save<T: Serialize>(path: impl AsRef<Path>, kind: &str, value: &T) -> Result<(), FileError> {
    let path = path.as_ref();
    write_atomically(path, |file| write(file, kind, value)).map_err(at(path))
}

/// Reads a value that [`save`] wrote with the same kind.
///
/// # Errors
/// [`FileError::At`] with the path and the cause. Refusing a damaged or foreign file takes memory
/// in proportion to its length at most.
pub fn load<T: DeserializeOwned>(path: impl AsRef<Path>, kind: &str) -> Result<T, FileError> {
    let path = path.as_ref();
    let open = || Ok(File::open(path)?);
    open()
        .and_then(|file| read(&mut BufReader::new(file), kind))
        .map_err(at(path))
}

/// Returns the bytes that [`save`] writes.
///
/// # Errors
/// A kind that is too long, or a value that serde cannot write in a compact format.
pub fn encode<T: Serialize>(kind: &str, value: &T) -> Result<Vec<u8>, FileError> {
    let mut bytes = Vec::new();
    write(&mut bytes, kind, value)?;
    Ok(bytes)
}

/// Reads the value in bytes that [`encode`] made with the same kind.
///
/// # Errors
/// [`FileError`], for every change of the bytes that the checksum can tell, which includes each
/// single-bit flip.
pub fn decode<T: DeserializeOwned>(kind: &str, bytes: &[u8]) -> Result<T, FileError> {
    read(&mut Cursor::new(bytes), kind)
}

fn at(path: &Path) -> impl FnOnce(FileError) -> FileError {
    let path = path.to_owned();
    |error| FileError::At {
        path,
        error: Box::new(error),
    }
}

/// A writer that sums up what it writes.
struct Summing<W> {
    writer: W,
    sum: crc32fast::Hasher,
}

impl<W: Write> Write for Summing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.writer.write(bytes)?;
        self.sum.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

fn write<T: Serialize>(writer: impl Write, kind: &str, value: &T) -> Result<(), FileError> {
    if kind.len() > NAME_LIMIT {
        return Err(FileError::KindTooLong(kind.len()));
    }
    let sum = crc32fast::Hasher::new();
    let mut file = Summing { writer, sum };
    file.write_all(&MAGIC)?;
    file.write_all(&FORMAT.to_le_bytes())?;
    for name in [kind, &types::<T>()] {
        file.write_all(&(name.len() as u32).to_le_bytes())?;
        file.write_all(name.as_bytes())?;
    }
    let written =
        bincode::serde::encode_into_std_write(value, &mut file, bincode::config::standard());
    match written {
        Err(bincode::error::EncodeError::Io { inner, .. }) => return Err(inner.into()),
        Err(bincode::error::EncodeError::OtherString(cause)) => {
            return Err(FileError::Encode(cause));
        }
        written => written.map_err(|error| FileError::Encode(error.to_string()))?,
    };
    let sum = file.sum.finalize();
    file.writer.write_all(&sum.to_le_bytes())?;
    Ok(())
}

fn read<T: DeserializeOwned>(file: &mut (impl Read + Seek), kind: &str) -> Result<T, FileError> {
    let end = check(file)?;
    for wanted in [kind, &types::<T>()] {
        let found = read_name(file)?;
        if found != wanted {
            return Err(FileError::Kind(wanted.to_owned(), found));
        }
    }
    let length = end.saturating_sub(file.stream_position()?);
    let mut payload = file.take(length);
    let value = if length <= SMALL {
        decode_within::<T, { widest(SMALL) }>(&mut payload)
    } else if length <= MEDIUM {
        decode_within::<T, { widest(MEDIUM) }>(&mut payload)
    } else if length <= LARGE {
        decode_within::<T, { widest(LARGE) }>(&mut payload)
    } else {
        decode_within::<T, { widest(HUGE) }>(&mut payload)
    }?;
    match payload.limit() {
        0 => Ok(value),
        extra => {
            let why = format!("{extra} bytes are left over after the value");
            Err(FileError::Contents(why))
        }
    }
}

/// Checks signature, version and checksum. Returns the end of the payload and leaves the file at
/// the kind.
fn check(file: &mut (impl Read + Seek)) -> Result<u64, FileError> {
    let mut magic = Vec::new();
    file.take(MAGIC.len() as u64).read_to_end(&mut magic)?;
    if magic != MAGIC {
        return Err(FileError::Signature);
    }
    let mut format = [0; 4];
    let cut_short = |_| FileError::Checksum(0, 0);
    file.read_exact(&mut format).map_err(cut_short)?;
    match u32::from_le_bytes(format) {
        FORMAT => {}
        found if found > FORMAT => return Err(FileError::Newer(found)),
        found => return Err(FileError::Older(found)),
    }
    let names = file.stream_position()?;
    let end = file.seek(SeekFrom::End(0))?.saturating_sub(CHECKSUM);
    file.rewind()?;
    let mut sum = crc32fast::Hasher::new();
    let (mut left, mut buffer) = (end, vec![0; 1 << 16]);
    while left > 0 {
        let part = &mut buffer[..left.min(1 << 16) as usize];
        file.read_exact(part)?;
        sum.update(part);
        left -= part.len() as u64;
    }
    let mut found = [0; CHECKSUM as usize];
    file.read_exact(&mut found).map_err(cut_short)?;
    let (found, computed) = (u32::from_le_bytes(found), sum.finalize());
    if found != computed {
        return Err(FileError::Checksum(found, computed));
    }
    file.seek(SeekFrom::Start(names))?;
    Ok(end)
}

fn read_name(file: &mut impl Read) -> Result<String, FileError> {
    let mut length = [0; 4];
    file.read_exact(&mut length)?;
    let length = u64::from(u32::from_le_bytes(length)).min(NAME_LIMIT as u64);
    let mut name = Vec::new();
    file.take(length).read_to_end(&mut name)?;
    Ok(String::from_utf8_lossy(&name).into_owned())
}

/// Payloads up to these lengths, in bytes, are held to claims of their own size.
const SMALL: u64 = 1 << 16;
const MEDIUM: u64 = 1 << 23;
const LARGE: u64 = 1 << 30;
const HUGE: u64 = 1 << 37;

/// Returns the most that bincode counts for a payload of a length: it counts numbers by their width
/// in memory, up to 16 bytes for each byte read.
const fn widest(length: u64) -> usize {
    let wide = length * 16;
    if wide > usize::MAX as u64 {
        usize::MAX
    } else {
        wide as usize
    }
}

/// Reads a value. bincode allocates a text before it looks for its end, hence the bound on
/// what a payload may claim.
fn decode_within<T: DeserializeOwned, const BOUND: usize>(
    payload: &mut impl Read,
) -> Result<T, FileError> {
    let config = bincode::config::standard().with_limit::<BOUND>();
    bincode::serde::decode_from_std_read(payload, config)
        .map_err(|error| FileError::Contents(error.to_string()))
}

/// Returns the types of this crate in the name of a type, in order: learners of the same layout are
/// told apart by them.
fn types<T>() -> String {
    let name = std::any::type_name::<T>();
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let mut types: Vec<&str> = name
        .split(|c| !is_word(c))
        .filter(|path| path.starts_with("qtable::"))
        .filter_map(|path| path.rsplit("::").next())
        .collect();
    let length = |types: &[&str]| types.iter().map(|name| name.len() + 1).sum::<usize>();
    while length(&types) > NAME_LIMIT {
        types.pop();
    }
    types.join(" ")
}

/// Writes a file beside its target and renames it. A target that is no regular file (a device, a
/// pipe) is written to and not replaced. A replaced file keeps its permissions.
fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> Result<(), FileError>,
) -> Result<(), FileError> {
    // A link stays a link: its target is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let buffered = |file: &File| {
        let mut writer = BufWriter::with_capacity(1 << 16, file);
        write(&mut writer)?;
        Ok::<_, FileError>(writer.flush()?)
    };
    let there = fs::metadata(&target).ok();
    if there.as_ref().is_some_and(|there| !there.is_file()) {
        return buffered(&File::options().write(true).open(&target)?);
    }
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let (beside, file) = create_beside(&target, folder)?;
    let written = buffered(&file).and_then(|()| {
        if let Some(there) = there {
            file.set_permissions(there.permissions())?;
        }
        file.sync_all()?;
        Ok(fs::rename(&beside, &target)?)
    });
    if written.is_err() {
        // The error that came first is reported.
        let _ = fs::remove_file(&beside);
    }
    written?;
    // The rename itself is on disk once the folder is; not all systems can sync one.
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Creates a locked temporary file beside the target, and removes those that a process that was
/// killed has left: nobody holds their lock.
fn create_beside(target: &Path, folder: &Path) -> io::Result<(PathBuf, File)> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let mut prefix = OsString::from(".");
    prefix.push(target.file_name().unwrap_or_default());
    prefix.push(".part-");
    for entry in fs::read_dir(folder)?.flatten() {
        let is_ours = entry
            .file_name()
            .as_encoded_bytes()
            .starts_with(prefix.as_encoded_bytes());
        let free = || File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok());
        if is_ours && free() {
            // Another process may have removed it.
            let _ = fs::remove_file(entry.path());
        }
    }
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let mut name = prefix.clone();
        name.push(format!("{}-{count}", std::process::id()));
        let beside = folder.join(name);
        let file = match File::create_new(&beside) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
            created => created?,
        };
        // Without the lock the file might be taken for one that was left behind.
        let unsupported =
            matches!(file.lock(), Err(error) if error.kind() == io::ErrorKind::Unsupported);
        if unsupported || beside.exists() {
            return Ok((beside, file));
        }
    }
}
