//! Values on disk: a versioned envelope, written atomically.
//!
//! Layout, numbers little-endian: 8 bytes magic `\x89QTBL\r\n\x1a`, `u32` format version, `u32`
//! length of the kind, `u64` length of the payload, the kind (UTF-8), the payload (bincode's
//! standard configuration), and the CRC-32 of everything before as `u32`.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

const MAGIC: [u8; 8] = *b"\x89QTBL\r\n\x1a";
const FORMAT: u32 = 1;
/// Magic, format, length of the kind, length of the payload.
const HEADER: usize = 8 + 4 + 4 + 8;
const CHECKSUM: usize = 4;
/// Largest payload, in bytes, that is written or read.
const LIMIT: usize = 1 << 30;
/// Payloads up to these lengths, in bytes, are held to smaller claims.
const SMALL: usize = 1 << 16;
const MEDIUM: usize = 1 << 23;
const KIND_LIMIT: usize = 255;

/// A file that could not be written or read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct PersistError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong.
    #[source]
    pub problem: Problem,
}

/// What is wrong with a file or its bytes.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The operating system refused: no such file, no permission, no space.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The bytes do not begin as this format does: another kind of file, or one damaged in transfer
    /// as text.
    #[error("not a file of this format (it does not begin with its signature)")]
    Signature,
    /// Written by a newer version of this crate: update it.
    #[error("format version {found} is newer than {known}, the newest known here")]
    Newer {
        /// Version in the file.
        found: u32,
        /// Version written here.
        known: u32,
    },
    /// A format version that was never written, or is no longer read.
    #[error("format version {found} is older than {known}, the oldest read here")]
    Older {
        /// Version in the file.
        found: u32,
        /// Oldest version read here.
        known: u32,
    },
    /// The file ends too early: an interrupted copy, or a claimed length that is not there.
    #[error(
        "{found} bytes where {needed} are needed: the file is cut short or its length field is damaged"
    )]
    Truncated {
        /// Bytes that the header asks for.
        needed: u128,
        /// Bytes there are.
        found: u64,
    },
    /// Bytes after the end.
    #[error("{extra} bytes too many after the end")]
    TrailingBytes {
        /// How many.
        extra: u64,
    },
    /// The checksum does not fit: the file is damaged.
    #[error("the checksum is {found:08x} but the bytes give {computed:08x}: the file is damaged")]
    Checksum {
        /// Checksum in the file.
        found: u32,
        /// Checksum of the bytes.
        computed: u32,
    },
    /// A sound file that holds something else.
    #[error("it holds {found:?}, not {wanted:?}")]
    Kind {
        /// Kind asked for.
        wanted: String,
        /// Kind in the file.
        found: String,
    },
    /// A kind name longer than 255 bytes.
    #[error("a kind name of {length} bytes is longer than 255")]
    KindTooLong {
        /// Its length in bytes.
        length: usize,
    },
    /// A value or file larger than 1 GiB.
    #[error("{bytes} bytes are more than the {limit} that are written or read")]
    TooLarge {
        /// Its size in bytes.
        bytes: u64,
        /// The limit in bytes.
        limit: u64,
    },
    /// The payload is not a valid value of the type asked for, for example a table with a NaN in
    /// it.
    #[error("the contents are not valid: {0}")]
    Contents(String),
    /// The value could not be encoded.
    #[error("the value cannot be written: {0}")]
    Encode(String),
}

/// Writes a value to a file, which appears whole or not at all: it is written beside the target and
/// then renamed.
///
/// `kind` says what it is, including the version of its type where that may change
/// (`"approach-policy/1"`); [`load`] asks for the same. An existing file is replaced and keeps its
/// permissions.
///
/// # Errors
/// [`PersistError`], which names the path.
pub fn save<T: Serialize>(path: &Path, kind: &str, value: &T) -> Result<(), PersistError> {
    encode(kind, value)
        .and_then(|bytes| write_atomically(path, &bytes).map_err(Problem::Io))
        .map_err(|problem| PersistError {
            path: path.to_owned(),
            problem,
        })
}

/// Reads a value that [`save`] wrote under the same kind.
///
/// # Errors
/// [`PersistError`], which names the path; a damaged, foreign or oversized file is refused within
/// bounded memory.
pub fn load<T: DeserializeOwned>(path: &Path, kind: &str) -> Result<T, PersistError> {
    read_bounded(path)
        .and_then(|bytes| decode(kind, &bytes))
        .map_err(|problem| PersistError {
            path: path.to_owned(),
            problem,
        })
}

/// The bytes that [`save`] writes.
///
/// # Errors
/// A kind or value that is too large, or a value that serde cannot write in a compact format.
pub fn encode<T: Serialize>(kind: &str, value: &T) -> Result<Vec<u8>, Problem> {
    if kind.len() > KIND_LIMIT {
        return Err(Problem::KindTooLong { length: kind.len() });
    }
    let payload = bincode::serde::encode_to_vec(value, bincode::config::standard())
        .map_err(|error| Problem::Encode(error.to_string()))?;
    if payload.len() > LIMIT {
        return Err(Problem::TooLarge {
            bytes: payload.len() as u64,
            limit: LIMIT as u64,
        });
    }
    let mut bytes = Vec::with_capacity(HEADER + kind.len() + payload.len() + CHECKSUM);
    bytes.extend(MAGIC);
    bytes.extend(FORMAT.to_le_bytes());
    bytes.extend((kind.len() as u32).to_le_bytes());
    bytes.extend((payload.len() as u64).to_le_bytes());
    bytes.extend(kind.as_bytes());
    bytes.extend(payload);
    let checksum = crc32fast::hash(&bytes);
    bytes.extend(checksum.to_le_bytes());
    Ok(bytes)
}

/// The value in bytes that [`encode`] made under the same kind.
///
/// # Errors
/// [`Problem`], for every change of the bytes that the checksum can tell, which includes each
/// single-bit flip.
pub fn decode<T: DeserializeOwned>(kind: &str, bytes: &[u8]) -> Result<T, Problem> {
    let found = bytes.len() as u64;
    let is_ours = bytes.len().min(MAGIC.len());
    if bytes[..is_ours] != MAGIC[..is_ours] {
        return Err(Problem::Signature);
    }
    let Some((header, _)) = bytes.split_first_chunk::<HEADER>() else {
        return Err(Problem::Truncated {
            needed: (HEADER + CHECKSUM) as u128,
            found,
        });
    };
    let [
        _,
        _,
        _,
        _,
        _,
        _,
        _,
        _,
        f0,
        f1,
        f2,
        f3,
        k0,
        k1,
        k2,
        k3,
        length @ ..,
    ] = *header;
    match u32::from_le_bytes([f0, f1, f2, f3]) {
        FORMAT => {}
        found if found > FORMAT => {
            return Err(Problem::Newer {
                found,
                known: FORMAT,
            });
        }
        found => {
            return Err(Problem::Older {
                found,
                known: FORMAT,
            });
        }
    }
    let kind_length = u32::from_le_bytes([k0, k1, k2, k3]);
    let needed = (HEADER + CHECKSUM) as u128
        + u128::from(kind_length)
        + u128::from(u64::from_le_bytes(length));
    if u128::from(found) < needed {
        return Err(Problem::Truncated { needed, found });
    }
    if u128::from(found) > needed {
        return Err(Problem::TrailingBytes {
            extra: (u128::from(found) - needed) as u64,
        });
    }
    let Some((sealed, checksum)) = bytes.split_last_chunk::<CHECKSUM>() else {
        return Err(Problem::Truncated { needed, found });
    };
    let (found, computed) = (u32::from_le_bytes(*checksum), crc32fast::hash(sealed));
    if found != computed {
        return Err(Problem::Checksum { found, computed });
    }
    let (found_kind, payload) = sealed[HEADER..].split_at(kind_length as usize);
    if found_kind != kind.as_bytes() {
        let found = String::from_utf8_lossy(found_kind).into_owned();
        return Err(Problem::Kind {
            wanted: kind.to_owned(),
            found,
        });
    }
    let decoded = if payload.len() <= SMALL {
        decode_within::<T, { widest(SMALL) }>(payload)
    } else if payload.len() <= MEDIUM {
        decode_within::<T, { widest(MEDIUM) }>(payload)
    } else {
        decode_within::<T, { widest(LIMIT) }>(payload)
    };
    let (value, used) = decoded.map_err(|error| Problem::Contents(error.to_string()))?;
    match payload.len() - used {
        0 => Ok(value),
        extra => Err(Problem::TrailingBytes {
            extra: extra as u64,
        }),
    }
}

/// The most that bincode counts for a payload of a length: it counts numbers by their width in
/// memory, up to 16 bytes for each byte read.
const fn widest(length: usize) -> usize {
    length.saturating_mul(16)
}

/// The value at the beginning of a payload, and how much of that it took. bincode makes room for a
/// text before it looks for its end, hence the bound on what a payload may claim.
fn decode_within<T: DeserializeOwned, const BOUND: usize>(
    payload: &[u8],
) -> Result<(T, usize), bincode::error::DecodeError> {
    bincode::serde::decode_from_slice(payload, bincode::config::standard().with_limit::<BOUND>())
}

fn read_bounded(path: &Path) -> Result<Vec<u8>, Problem> {
    let limit = (HEADER + KIND_LIMIT + LIMIT + CHECKSUM) as u64;
    let file = fs::File::open(path)?;
    let mut bytes = Vec::new();
    // One byte more than the limit tells a file that is too large, whatever its metadata say.
    file.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        let bytes = fs::metadata(path).map_or(limit + 1, |metadata| metadata.len());
        return Err(Problem::TooLarge { bytes, limit });
    }
    Ok(bytes)
}

/// Writes a file beside its target and renames it; a target that is there and is no regular file (a
/// device, a pipe) is written to as it is, not replaced. The permissions are those of the file
/// replaced, or of a file created in the ordinary way.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    // A link stays a link: what it points to is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if fs::metadata(&target).is_ok_and(|there| !there.is_file()) {
        return fs::write(&target, bytes);
    }
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".qtable-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The process's mask is applied to it, as to any new file.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder)?;
    if let Ok(metadata) = fs::metadata(&target) {
        file.as_file().set_permissions(metadata.permissions())?;
    }
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(&target)?;
    Ok(())
}
