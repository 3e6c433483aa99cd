//! The pages of a TIFF: microscopes and scanners write one frame to each. Decoders read the first
//! page; [`Page`] makes another one the first.

use std::collections::HashSet;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use tiff::decoder::Decoder;
use tiff::tags::{IfdPointer, Tag};

use crate::image_file::Source;

/// Bits of the kind of a page: a smaller copy of another page, or a mask.
const NO_FRAME: u64 = 0b101;

/// Where the pages of a TIFF that are frames begin; none of another file, or if its first page is
/// damaged. Smaller copies of pages and masks are no frames.
///
/// # Errors
/// A list of several pages that is damaged.
pub fn find(source: Source, length: u64) -> io::Result<Vec<u64>> {
    let Ok(mut tiff) = Decoder::new(source) else { return Ok(Vec::new()) };
    let first = tiff.ifd_pointer();
    let (mut pages, mut seen, mut left) = (Vec::new(), HashSet::new(), length);
    let mut next = first;
    while let Some(page) = next {
        let read = if seen.insert(page) { read_page(&mut tiff, page, &mut left) } else { None };
        let Some((is_frame, after)) = read else {
            // Some programs write anything after the only page.
            if seen.len() <= 2 {
                break;
            }
            let reason = format!("the list of its pages is damaged after page {}", seen.len() - 1);
            return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
        };
        if is_frame {
            pages.push(page.0);
        }
        next = after;
    }
    if pages.is_empty() {
        pages.extend(first.map(|first| first.0));
    }
    Ok(pages)
}

/// Reads a page's table: whether the page is a frame, and where the next one begins; `None` if it is
/// not there. The tables together have at most `left` bytes.
fn read_page(
    tiff: &mut Decoder<Source>,
    page: IfdPointer,
    left: &mut u64,
) -> Option<(bool, Option<IfdPointer>)> {
    let table = tiff.read_directory(page).ok()?;
    *left = left.checked_sub(tiff.inner().stream_position().ok()?.checked_sub(page.0)?)?;
    // A kind that cannot be read says nothing.
    let kind = tiff.read_directory_tags(&table).find_tag_unsigned::<u64>(Tag::NewSubfileType);
    Some((kind.ok().flatten().unwrap_or(0) & NO_FRAME == 0, table.next()))
}

/// A TIFF whose first page is another one.
pub struct Page {
    source: File,
    /// Up to the offset of the first page, which is that of this one.
    header: Vec<u8>,
    at: u64,
}

impl Page {
    /// The page that begins here; `None` if the file is not a TIFF.
    pub fn new(mut source: File, begin: u64) -> io::Result<Option<Self>> {
        let mut header = Vec::new();
        source.rewind()?;
        (&source).take(16).read_to_end(&mut header)?;
        let (offset, begin) = match header.get(..4) {
            Some(b"II\x2a\0") => (4..8, &begin.to_le_bytes()[..4]),
            Some(b"MM\0\x2a") => (4..8, &begin.to_be_bytes()[4..]),
            Some(b"II\x2b\0") => (8..16, &begin.to_le_bytes()[..]),
            Some(b"MM\0\x2b") => (8..16, &begin.to_be_bytes()[..]),
            _ => return Ok(None),
        };
        header.truncate(offset.end);
        let Some(first) = header.get_mut(offset) else { return Ok(None) };
        first.copy_from_slice(begin);
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
