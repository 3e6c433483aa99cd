//! The pages of a TIFF: microscopes and scanners write one frame to each. Decoders read the first
//! page; [`Page`] makes another one the first.

use std::collections::HashSet;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use crate::image_file::Source;

/// The tag that says what a page is: bit 0 for a smaller copy of another page, bit 2 for a mask.
const KIND: u64 = 254;
const NO_FRAME: u64 = 0b101;

/// How the numbers of a TIFF are written.
#[derive(Clone, Copy)]
struct Form {
    is_big_endian: bool,
    /// Whether offsets have eight bytes.
    is_big: bool,
}

/// The header of a TIFF, and where the offset of the first page is in it.
struct Header {
    bytes: Vec<u8>,
    form: Form,
}

impl Header {
    /// Reads the first bytes of a file; `None` if they are not those of a TIFF.
    fn read(source: &mut (impl Read + Seek)) -> io::Result<Option<Self>> {
        source.rewind()?;
        let mut bytes = Vec::new();
        source.take(16).read_to_end(&mut bytes)?;
        let (is_big_endian, is_big) = match bytes.get(..4) {
            Some(b"II\x2a\0") => (false, false),
            Some(b"MM\0\x2a") => (true, false),
            Some(b"II\x2b\0") => (false, true),
            Some(b"MM\0\x2b") => (true, true),
            _ => return Ok(None),
        };
        let form = Form { is_big_endian, is_big };
        bytes.truncate(2 * form.offset());
        Ok((bytes.len() == 2 * form.offset()).then_some(Self { bytes, form }))
    }
}

impl Form {
    /// Bytes of an offset. That of the first page comes after as many bytes.
    fn offset(self) -> usize {
        if self.is_big { 8 } else { 4 }
    }

    fn number(self, bytes: &[u8]) -> u64 {
        let add = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        match self.is_big_endian {
            true => bytes.iter().fold(0, add),
            false => bytes.iter().rev().fold(0, add),
        }
    }

    fn read(self, source: &mut impl Read, bytes: usize) -> io::Result<u64> {
        let mut buffer = [0; 8];
        source.read_exact(&mut buffer[..bytes])?;
        Ok(self.number(&buffer[..bytes]))
    }
}

/// Where the pages of a TIFF that are frames begin; none of another file. Smaller copies of pages
/// and masks are no frames.
///
/// # Errors
/// A list of several pages that is damaged.
pub fn find(mut source: Source, length: u64) -> io::Result<Vec<u64>> {
    let Some(Header { bytes, form }) = Header::read(&mut source)? else { return Ok(Vec::new()) };
    let mut next = form.number(&bytes[form.offset()..]);
    let first = next;
    let (mut pages, mut seen, mut left) = (Vec::new(), HashSet::new(), length);
    while next != 0 {
        let read =
            if seen.insert(next) { read_page(&mut source, form, next, &mut left) } else { None };
        let Some((is_frame, after)) = read else {
            // Some programs write anything after the only page.
            if seen.len() <= 2 {
                break;
            }
            let reason = format!("the list of its pages is damaged after page {}", seen.len() - 1);
            return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
        };
        if is_frame {
            pages.push(next);
        }
        next = after;
    }
    if pages.is_empty() {
        pages.push(first);
    }
    Ok(pages)
}

/// Reads a page's table: whether the page is a frame, and where the next one begins; `None` if it is
/// not there. The tables together have at most `left` bytes.
fn read_page(source: &mut Source, form: Form, at: u64, left: &mut u64) -> Option<(bool, u64)> {
    source.seek(SeekFrom::Start(at)).ok()?;
    let (of_count, of_entry) = if form.is_big { (8, 20) } else { (2, 12) };
    let count = form.read(source, of_count).ok()?;
    let bytes = count.checked_mul(of_entry)?;
    *left = left.checked_sub(bytes.checked_add((of_count + form.offset()) as u64)?)?;
    let mut table = Vec::new();
    source.take(bytes).read_to_end(&mut table).ok()?;
    if table.len() as u64 != bytes {
        return None;
    }
    let mut entries = table.chunks_exact(of_entry as usize);
    let found = entries.find(|entry| form.number(&entry[..2]) == KIND);
    let kind = found.map_or(0, |entry| {
        // A short number is at the beginning of the place for a longer one.
        let bytes = if form.number(&entry[2..4]) == 3 { 2 } else { 4 };
        form.number(&entry[of_entry as usize - form.offset()..][..bytes])
    });
    Some((kind & NO_FRAME == 0, form.read(source, form.offset()).ok()?))
}

/// A TIFF whose first page is another one.
pub struct Page {
    source: File,
    header: Vec<u8>,
    at: u64,
}

impl Page {
    /// The page that begins here; `None` if the file is not a TIFF.
    pub fn new(mut source: File, begin: u64) -> io::Result<Option<Self>> {
        let Some(Header { bytes: mut header, form }) = Header::read(&mut source)? else {
            return Ok(None);
        };
        let bytes = begin.to_be_bytes();
        let offset = &mut header[form.offset()..];
        offset.copy_from_slice(&bytes[bytes.len() - form.offset()..]);
        if !form.is_big_endian {
            offset.reverse();
        }
        source.rewind()?;
        Ok(Some(Self { source, header, at: 0 }))
    }
}

impl Read for Page {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let header = usize::try_from(self.at).ok().and_then(|at| self.header.get(at..));
        let count = match header.filter(|rest| !rest.is_empty()) {
            Some(mut header) => {
                let count = header.read(buffer)?;
                self.source.seek(SeekFrom::Start(self.at + count as u64))?;
                count
            }
            None => self.source.read(buffer)?,
        };
        self.at += count as u64;
        Ok(count)
    }
}

impl Seek for Page {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.source.seek(to)?;
        Ok(self.at)
    }
}
