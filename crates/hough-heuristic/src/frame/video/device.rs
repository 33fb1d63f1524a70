//! The requests of V4L2 to a device, and the buffers that the driver shares.

// No crate that serves builds without libclang and the kernel's headers.
#![allow(unsafe_code)]

use std::ffi::{c_int, c_long, c_void};
use std::fs::File;
use std::{io, ptr, slice};

use rustix::io::Errno;
use rustix::ioctl::{Opcode, Updater, ioctl, opcode};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use crate::frame::video::{FORMATS, Layout};

/// `struct v4l2_capability`.
#[repr(C)]
#[derive(Default)]
struct Capability {
    driver: [u8; 16],
    card: [u8; 32],
    bus: [u8; 32],
    version: u32,
    all: u32,
    of_device: u32,
    reserved: [u32; 3],
}

/// `struct v4l2_format` with a `v4l2_pix_format`, whose fields are: width, height, pixels, field,
/// stride, size, and others.
#[repr(C)]
#[derive(Clone)]
struct Format {
    kind: u32,
    /// Alignment of the union.
    pointers: [usize; 0],
    fields: [u32; 12],
    rest: [u32; 38],
}

/// `struct v4l2_requestbuffers`.
#[repr(C)]
#[derive(Default)]
struct Request {
    count: u32,
    kind: u32,
    memory: u32,
    reserved: [u32; 2],
}

/// `struct v4l2_buffer`, with the union of offset and pointer.
#[repr(C)]
#[derive(Default)]
struct Buffer {
    index: u32,
    kind: u32,
    used: u32,
    flags: u32,
    field: u32,
    time: [c_long; 2],
    time_code: [u32; 4],
    sequence: u32,
    memory: u32,
    offset: Offset,
    length: u32,
    reserved: [u32; 2],
}

/// An offset where a pointer has its place.
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Offset {
    pointers: [usize; 0],
    low: u32,
    #[cfg(target_pointer_width = "64")]
    high: u32,
}

const V4L2: u8 = b'V';
const QUERYCAP: Opcode = opcode::read::<Capability>(V4L2, 0);
const G_FMT: Opcode = opcode::read_write::<Format>(V4L2, 4);
const S_FMT: Opcode = opcode::read_write::<Format>(V4L2, 5);
const REQBUFS: Opcode = opcode::read_write::<Request>(V4L2, 8);
const QUERYBUF: Opcode = opcode::read_write::<Buffer>(V4L2, 9);
const QBUF: Opcode = opcode::read_write::<Buffer>(V4L2, 15);
const DQBUF: Opcode = opcode::read_write::<Buffer>(V4L2, 17);
const STREAMON: Opcode = opcode::write::<c_int>(V4L2, 18);

/// `V4L2_BUF_TYPE_VIDEO_CAPTURE` and `V4L2_MEMORY_MMAP`.
const CAPTURE: u32 = 1;
const MAPPED: u32 = 1;
/// `V4L2_CAP_VIDEO_CAPTURE`, `V4L2_CAP_STREAMING` and `V4L2_CAP_DEVICE_CAPS`.
const CAN_CAPTURE: u32 = 1;
const CAN_STREAM: u32 = 0x0400_0000;
const HAS_OF_DEVICE: u32 = 0x8000_0000;
/// `V4L2_BUF_FLAG_ERROR`.
const DAMAGED: u32 = 0x40;
/// Buffers that the driver is asked for.
const BUFFERS: u32 = 4;

/// Makes a request of the device.
///
/// # Safety
/// `T` is the argument of the request `OPCODE`.
unsafe fn ask<const OPCODE: Opcode, T>(file: &File, argument: &mut T) -> io::Result<()> {
    loop {
        // SAFETY: the caller's; the argument is borrowed for the time of the call.
        match unsafe { ioctl(file, Updater::<OPCODE, T>::new(argument)) } {
            Err(Errno::INTR) => {}
            done => return Ok(done?),
        }
    }
}

/// Makes a request whose argument has the type that its number is made of.
macro_rules! ask {
    ($file:expr, $opcode:ident, $argument:expr) => {
        // SAFETY: each opcode above is made of the type of its argument, and is passed that type.
        unsafe { ask::<$opcode, _>($file, $argument) }
    };
}

/// A buffer of the driver in the memory of this program.
#[derive(Debug)]
struct Mapping {
    at: *mut c_void,
    length: usize,
}

// SAFETY: the memory belongs to no thread.
unsafe impl Send for Mapping {}

impl Mapping {
    fn of(file: &File, buffer: &Buffer) -> io::Result<Self> {
        let (length, offset) = (buffer.length as usize, u64::from(buffer.offset.low));
        // SAFETY: the system chooses a free place; nothing else is mapped there.
        let at = unsafe {
            let (how, shared) = (ProtFlags::READ, MapFlags::SHARED);
            mmap(ptr::null_mut(), length, how, shared, file, offset)?
        };
        Ok(Self { at, length })
    }

    /// Returns the first bytes of the buffer, which the driver must have handed over.
    fn bytes(&self, count: u32) -> &[u8] {
        let count = self.length.min(count as usize);
        // SAFETY: so many bytes are mapped while `self` lives, and the driver writes into a buffer
        // only between its QBUF and its DQBUF.
        unsafe { slice::from_raw_parts(self.at.cast(), count) }
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: mapped by `of`; `bytes` has lent nothing that is still borrowed.
        let _ = unsafe { munmap(self.at, self.length) };
    }
}

/// A device that delivers frames.
#[derive(Debug)]
pub(super) struct Device {
    file: File,
    buffers: Vec<Mapping>,
}

impl Device {
    pub(super) fn open(path: &str, size: Option<(u32, u32)>) -> io::Result<(Self, Layout)> {
        let file = File::options().read(true).write(true).open(path)?;
        let mut can = Capability::default();
        ask!(&file, QUERYCAP, &mut can)
            .map_err(|error| io::Error::other(format!("it is no video device: {error}")))?;
        let can = match can.all & HAS_OF_DEVICE {
            0 => can.all,
            _ => can.of_device,
        };
        if can & CAN_CAPTURE == 0 || can & CAN_STREAM == 0 {
            let advice = "another device of the same camera may (v4l2-ctl --list-devices)";
            return Err(io::Error::other(format!("it captures no frames; {advice}")));
        }
        let layout = set_format(&file, size)?;
        let mut request = Request {
            count: BUFFERS,
            kind: CAPTURE,
            memory: MAPPED,
            ..Request::default()
        };
        ask!(&file, REQBUFS, &mut request).map_err(in_use)?;
        let mut buffers = Vec::new();
        for index in 0..request.count {
            let mut buffer = captured(index);
            ask!(&file, QUERYBUF, &mut buffer)?;
            buffers.push(Mapping::of(&file, &buffer)?);
            ask!(&file, QBUF, &mut captured(index))?;
        }
        let mut kind = CAPTURE as c_int;
        ask!(&file, STREAMON, &mut kind).map_err(in_use)?;
        Ok((Self { file, buffers }, layout))
    }

    /// Waits for the next frame and shows its bytes to `take`.
    pub(super) fn next<T>(&mut self, take: impl FnOnce(&[u8]) -> T) -> io::Result<T> {
        loop {
            let mut buffer = captured(0);
            ask!(&self.file, DQBUF, &mut buffer)?;
            let mapping = self.buffers.get(buffer.index as usize);
            let mapping = mapping.ok_or_else(|| io::Error::other("the driver lost a buffer"))?;
            let whole = buffer.flags & DAMAGED == 0;
            if whole {
                let taken = take(mapping.bytes(buffer.used));
                ask!(&self.file, QBUF, &mut captured(buffer.index))?;
                return Ok(taken);
            }
            ask!(&self.file, QBUF, &mut captured(buffer.index))?;
        }
    }
}

fn captured(index: u32) -> Buffer {
    Buffer {
        index,
        kind: CAPTURE,
        memory: MAPPED,
        ..Buffer::default()
    }
}

/// Sets the first format that the device has, and returns what it has made of it.
fn set_format(file: &File, size: Option<(u32, u32)>) -> io::Result<Layout> {
    let mut present = Format {
        kind: CAPTURE,
        pointers: [],
        fields: [0; 12],
        rest: [0; 38],
    };
    ask!(file, G_FMT, &mut present)?;
    for (name, pixels) in FORMATS {
        let code = u32::from_le_bytes(*name);
        let mut set = present.clone();
        let [width, height, ..] = set.fields;
        let (width, height) = size.unwrap_or((width, height));
        // Stride and size are for the driver to say.
        set.fields = [width, height, code, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        match ask!(file, S_FMT, &mut set) {
            Err(error) if Errno::from_io_error(&error) == Some(Errno::INVAL) => continue,
            done => done.map_err(in_use)?,
        }
        let [now_width, now_height, now_code, _, stride, ..] = set.fields;
        if now_code != code {
            continue;
        }
        if size.is_some_and(|size| size != (now_width, now_height)) || now_width * now_height == 0 {
            let message = format!("it has {now_width}x{now_height} px, no {width}x{height}");
            return Err(io::Error::other(message));
        }
        return Ok(Layout {
            pixels,
            width: now_width,
            height: now_height,
            stride,
        });
    }
    let names = FORMATS.map(|(name, _)| String::from_utf8_lossy(name).into_owned());
    let message = format!("it has none of the formats {}", names.join(", "));
    Err(io::Error::other(message))
}

fn in_use(error: io::Error) -> io::Error {
    match Errno::from_io_error(&error) {
        Some(Errno::BUSY) => io::Error::other("another program uses it"),
        _ => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::{offset_of, size_of};

    /// Numbers of the header `videodev2.h`, on a machine of 64 bits.
    #[cfg(target_pointer_width = "64")]
    #[test]
    fn requests_and_structures_are_those_of_the_kernel() {
        let requests = [
            QUERYCAP, G_FMT, S_FMT, REQBUFS, QUERYBUF, QBUF, DQBUF, STREAMON,
        ];
        let kernel: [Opcode; 8] = [
            0x8068_5600,
            0xc0d0_5604,
            0xc0d0_5605,
            0xc014_5608,
            0xc058_5609,
            0xc058_560f,
            0xc058_5611,
            0x4004_5612,
        ];
        assert_eq!(requests, kernel);
        assert_eq!(size_of::<Format>(), 208);
        assert_eq!(offset_of!(Format, fields), 8);
        assert_eq!(offset_of!(Capability, of_device), 88);
        let buffer = [
            offset_of!(Buffer, flags),
            offset_of!(Buffer, memory),
            offset_of!(Buffer, offset),
            offset_of!(Buffer, length),
        ];
        assert_eq!(buffer, [12, 60, 64, 72]);
    }
}
