//! Reads Y4M (YUV4MPEG2): uncompressed 8-bit video with a one-line header, from a stream or a file.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use crate::colour::{self, Colour, Matrix, Planes};
use crate::limits::{self, Limits};
use crate::{
    Container, Error, FrameFault, FrameRate, FrameSource, Picture, Pixels, SourceInfo, without_path,
};

/// The first bytes of every Y4M stream.
pub const MAGIC: &[u8] = b"YUV4MPEG2";

/// The parsed header line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Header {
    width: usize,
    height: usize,
    pub rate: Option<FrameRate>,
    /// Luma pixels per chroma sample, horizontally and vertically; `None` for grey.
    subsampling: Option<(usize, usize)>,
    full_range: bool,
    /// The format has no word for the matrix.
    matrix: Matrix,
}

impl Header {
    /// Parses the header line; the error is the reason why it is invalid.
    fn parse(line: &str) -> Result<Self, String> {
        let mut words = line.split(' ');
        if words.next().map(str::as_bytes) != Some(MAGIC) {
            return Err("not Y4M data: they do not start with YUV4MPEG2".to_string());
        }
        let mut header = Self {
            width: 0,
            height: 0,
            rate: None,
            subsampling: Some((2, 2)),
            full_range: false,
            matrix: Matrix::Bt601,
        };
        for word in words.filter(|word| !word.is_empty()) {
            let (tag, value) = word.split_at(word.chars().next().map_or(0, char::len_utf8));
            match tag {
                "W" => header.width = number(value, "the width is not a number")?,
                "H" => header.height = number(value, "the height is not a number")?,
                "F" => header.rate = parse_rate(value),
                "C" => header.subsampling = parse_chroma(value)?,
                "X" if value == "COLORRANGE=FULL" => header.full_range = true,
                _ => {} // interlacing, aspect ratio and comments are not used
            }
        }
        let allowed = 1..=limits::SIDE;
        if !allowed.contains(&header.width) || !allowed.contains(&header.height) {
            return Err(format!(
                "the Y4M header has an invalid size of {} x {}",
                header.width, header.height
            ));
        }
        header.matrix = Matrix::usual(header.width, header.height);
        Ok(header)
    }

    /// Width and height.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    fn with(self, matrix: Option<Matrix>) -> Self {
        Self { matrix: matrix.unwrap_or(self.matrix), ..self }
    }

    fn chroma_samples(&self) -> usize {
        self.subsampling
            .map_or(0, |(across, down)| self.width.div_ceil(across) * self.height.div_ceil(down))
    }

    /// Bytes of the samples of a frame.
    pub fn frame_bytes(&self) -> usize {
        self.width * self.height + 2 * self.chroma_samples()
    }

    /// The frame of this number with these samples.
    pub fn picture(&self, data: &[u8], index: usize) -> Picture {
        let (y, chroma) = data.split_at(self.width * self.height);
        let (u, v) = chroma.split_at(self.chroma_samples());
        let pixels = match self.subsampling {
            None => Pixels::Grey8(colour::luma_to_grey(y, self.full_range)),
            Some(subsampling) => {
                let planes =
                    Planes { width: self.width, height: self.height, y, u, v, subsampling };
                Pixels::Rgb8(colour::to_rgb(
                    &planes,
                    Colour { full_range: self.full_range, matrix: self.matrix },
                ))
            }
        };
        Picture::new(self.width, self.height, pixels).at(self.rate.map(|rate| rate.time(index)))
    }
}

fn number(text: &str, otherwise: &str) -> Result<usize, String> {
    text.parse().map_err(|error| format!("{otherwise}: {error}"))
}

fn parse_rate(value: &str) -> Option<FrameRate> {
    let (frames, seconds) = value.split_once(':')?;
    FrameRate::new(frames.parse().ok()?, seconds.parse().ok()?)
}

fn parse_chroma(value: &str) -> Result<Option<(usize, usize)>, String> {
    Ok(match value {
        "420" | "420jpeg" | "420mpeg2" | "420paldv" => Some((2, 2)),
        "422" => Some((2, 1)),
        "444" => Some((1, 1)),
        "411" => Some((4, 1)),
        "mono" => None,
        other => {
            return Err(format!(
                "the Y4M colour format {other} is not supported; 8-bit 420, 422, 444, 411 and mono are"
            ));
        }
    })
}

/// Reads a line without its line end. An empty string means the end of the data.
fn read_line(input: &mut impl BufRead) -> io::Result<String> {
    let line = piece_of_line(input)?.unwrap_or_default();
    if line.len() as u64 >= limits::LINE_BYTES {
        return Err(io::Error::other("a header line is too long"));
    }
    Ok(line)
}

/// Reads a line without its line end, or the next part of one that is too long; `None` at the end.
pub fn piece_of_line(input: &mut impl BufRead) -> io::Result<Option<String>> {
    let mut line = Vec::new();
    let count = input.by_ref().take(limits::LINE_BYTES).read_until(b'\n', &mut line)?;
    line.pop_if(|last| *last == b'\n');
    Ok((count > 0).then(|| String::from_utf8_lossy(&line).into_owned()))
}

fn read_header(input: &mut impl BufRead, name: &str, limits: Limits) -> Result<Header, Error> {
    let line = read_line(input).map_err(|error| error.to_string());
    let header = line
        .and_then(|line| Header::parse(&line))
        .map_err(|reason| Error::unreadable_in(Container::Y4m, name, reason))?;
    limits
        .check(header.width, header.height)
        .map_err(|size| Error::TooLarge { what: name.to_string(), size })?;
    Ok(header)
}

/// Reads the samples of a frame. Memory is taken as the data come, not as the header claims.
fn read_samples(input: &mut impl Read, count: usize) -> Result<Vec<u8>, String> {
    let mut data = Vec::new();
    input.take(count as u64).read_to_end(&mut data).map_err(|error| error.to_string())?;
    if data.len() < count { Err("the data are truncated".to_string()) } else { Ok(data) }
}

fn damaged(name: &str, index: usize, reason: impl ToString) -> Error {
    let (name, reason) = (name.to_string(), reason.to_string());
    Error::Frame { index, name, fault: FrameFault::Unreadable, reason }
}

/// Opens a stream. For reverse order it is first copied to a temporary file, since a pipe cannot be
/// read backwards.
pub fn open_stream(
    input: impl Read + Send + 'static,
    name: &str,
    reverse: bool,
    limits: Limits,
) -> Result<Box<dyn FrameSource>, Error> {
    if reverse {
        return Ok(Box::new(spooled(input, name, limits, None)?));
    }
    Ok(Box::new(Y4mStream::begin(input, name, limits, None)?))
}

/// Reads a stream to its end, and copies it to a temporary file. Without a `matrix`, it is the usual
/// one.
pub fn spooled(
    input: impl Read,
    name: &str,
    limits: Limits,
    matrix: Option<Matrix>,
) -> Result<Y4mFile, Error> {
    Y4mFile::index(spool(&mut BufReader::new(input), name)?, name, limits, matrix)
}

/// Copies a stream to an unnamed temporary file, which is removed when it is closed.
fn spool(input: &mut impl BufRead, name: &str) -> Result<File, Error> {
    let folder = std::env::temp_dir();
    let no_room = |error: io::Error| {
        let reason = without_path(&error).unwrap_or(error).to_string();
        Error::StreamCopy { name: name.to_string(), folder: folder.display().to_string(), reason }
    };
    let mut file = tempfile::tempfile_in(&folder).map_err(no_room)?;
    loop {
        let data = input.fill_buf().map_err(|error| Error::StreamEnd {
            name: name.to_string(),
            reason: error.to_string(),
        })?;
        let count = data.len();
        if count == 0 {
            break;
        }
        file.write_all(data).map_err(no_room)?;
        input.consume(count);
    }
    file.rewind().map_err(no_room)?;
    Ok(file)
}

/// Y4M from a pipe: frames can only be read forwards.
pub struct Y4mStream<R> {
    input: BufReader<R>,
    header: Header,
    name: String,
    next: usize,
}

impl<R: Read> Y4mStream<R> {
    /// Reads the header. Without a `matrix`, it is the usual one.
    pub fn begin(
        input: R,
        name: &str,
        limits: Limits,
        matrix: Option<Matrix>,
    ) -> Result<Self, Error> {
        let mut input = BufReader::new(input);
        let header = read_header(&mut input, name, limits)?.with(matrix);
        Ok(Self { input, header, name: name.to_string(), next: 0 })
    }

    pub fn header(&self) -> Header {
        self.header
    }

    /// The raw samples of the next frame; `None` at the end.
    pub fn read_next(&mut self) -> Result<Option<Vec<u8>>, Error> {
        let index = self.next;
        let line = read_line(&mut self.input).map_err(|error| damaged(&self.name, index, error))?;
        if line.is_empty() {
            return Ok(None);
        }
        if !line.starts_with("FRAME") {
            return Err(damaged(&self.name, index, "the frame's header is missing"));
        }
        let data = read_samples(&mut self.input, self.header.frame_bytes())
            .map_err(|reason| damaged(&self.name, index, reason))?;
        self.next += 1;
        Ok(Some(data))
    }
}

impl<R: Read + Send> FrameSource for Y4mStream<R> {
    fn info(&self) -> SourceInfo {
        SourceInfo { rate: self.header.rate, ..SourceInfo::default() }
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        loop {
            let is_wanted = self.next == index;
            let Some(data) = self.read_next()? else { return Ok(None) };
            if is_wanted {
                return Ok(Some(self.header.picture(&data, index)));
            }
        }
    }
}

/// Y4M from a file: frames can be read in any order.
pub struct Y4mFile {
    stream: Y4mStream<File>,
    /// Byte offset of the samples of each frame.
    offsets: Vec<u64>,
}

impl Y4mFile {
    /// Opens a file and indexes its frames.
    pub fn open(path: &Path, limits: Limits) -> Result<Self, Error> {
        let name = path.display().to_string();
        let file = File::open(path).map_err(|error| Error::unreadable(&name, error))?;
        Self::index(file, &name, limits, None)
    }

    pub fn header(&self) -> Header {
        self.stream.header
    }

    fn index(
        file: File,
        name: &str,
        limits: Limits,
        matrix: Option<Matrix>,
    ) -> Result<Self, Error> {
        let cannot = |error: io::Error| Error::unreadable(name, error);
        let size = file.metadata().map_err(cannot)?.len();
        let mut stream = Y4mStream::begin(file, name, limits, matrix)?;
        let (input, mut offsets) = (&mut stream.input, Vec::new());
        while input.stream_position().map_err(cannot)? < size {
            let line = read_line(input).map_err(|error| damaged(name, offsets.len(), error))?;
            if !line.starts_with("FRAME") {
                return Err(damaged(name, offsets.len(), "the frame's header is missing"));
            }
            offsets.push(input.stream_position().map_err(cannot)?);
            // A truncated last frame stays in the index, so that reading it is an error.
            input.seek_relative(stream.header.frame_bytes() as i64).map_err(cannot)?;
        }
        Ok(Self { stream, offsets })
    }
}

impl FrameSource for Y4mFile {
    fn info(&self) -> SourceInfo {
        SourceInfo { length: Some(self.offsets.len()), ..self.stream.info() }
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        let Some(&offset) = self.offsets.get(index) else { return Ok(None) };
        let Y4mStream { input, header, name, .. } = &mut self.stream;
        let sought = input.seek(SeekFrom::Start(offset)).map_err(|error| error.to_string());
        let data = sought
            .and_then(|_| read_samples(input, header.frame_bytes()))
            .map_err(|reason| damaged(name, index, reason))?;
        Ok(Some(header.picture(&data, index)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(frames: u8) -> Vec<u8> {
        let mut data = b"YUV4MPEG2 W4 H2 F25:1 Ip C444 XCOLORRANGE=FULL\n".to_vec();
        for k in 0..frames {
            data.extend(b"FRAME\n");
            data.extend([k; 8]);
            data.extend([128; 16]);
        }
        data
    }

    fn stream_of(data: Vec<u8>, reverse: bool) -> Result<Box<dyn FrameSource>, Error> {
        open_stream(io::Cursor::new(data), "s", reverse, Limits::default())
    }

    #[test]
    fn a_header_that_claims_too_much_is_refused_before_memory_is_taken() {
        for reverse in [false, true] {
            let open = |text: &str| stream_of(text.into(), reverse);
            let error = open("YUV4MPEG2 W32768 H32768\nFRAME\n").err().expect("too large");
            assert!(error.to_string().contains("32768 x 32768 pixels"), "{error}");
            assert!(matches!(error, Error::TooLarge { size, .. } if size.pixels == 1_073_741_824));
            let mut source = open("YUV4MPEG2 W6000 H6000\nFRAME\n").expect("as large as allowed");
            assert!(source.frame(0).expect_err("no data").to_string().contains("truncated"));
        }
    }

    #[test]
    fn a_stream_and_its_temporary_copy_agree() {
        let mut forwards = stream_of(stream(5), false).expect("opens");
        let mut backwards = stream_of(stream(5), true).expect("opens");
        assert_eq!((forwards.length(), backwards.length()), (None, Some(5)));
        assert_eq!(forwards.rate(), FrameRate::new(25, 1));
        let rising: Vec<_> = [0, 2, 4].map(|k| forwards.frame(k).expect("reads")).into();
        let falling: Vec<_> = [4, 2, 0].map(|k| backwards.frame(k).expect("reads")).into();
        assert_eq!(rising, falling.into_iter().rev().collect::<Vec<_>>());
        assert_eq!(rising[1].as_ref().map(|p| p.pixels.clone()), Some(Pixels::Rgb8(vec![2; 24])));
        assert_eq!(rising[1].as_ref().and_then(|p| p.time), Some(2.0 / 25.0));
        assert!(forwards.frame(5).expect("reads").is_none());
    }

    #[test]
    fn a_truncated_frame_is_an_error_that_names_it() {
        let mut data = stream(3);
        data.truncate(data.len() - 5);
        for reverse in [false, true] {
            let mut source = stream_of(data.clone(), reverse).expect("opens");
            assert!(source.frame(1).expect("whole").is_some());
            let error = source.frame(2).expect_err("cut");
            assert!(error.to_string().contains("frame 2"), "{error}");
        }
    }

    #[test]
    fn bad_headers_are_refused() {
        for bad in [
            "YUV4MPEG2 W0 H5",
            "YUV4MPEG2 W5",
            "JUNK W5 H5",
            "YUV4MPEG2 W5 H5 C420p10",
            "YUV4MPEG2 Wx H5",
        ] {
            assert!(Header::parse(bad).is_err(), "{bad}");
        }
        let plain = Header::parse("YUV4MPEG2 W5 H5").expect("the other fields have defaults");
        assert_eq!(plain.frame_bytes(), 25 + 2 * 9);
    }
}
