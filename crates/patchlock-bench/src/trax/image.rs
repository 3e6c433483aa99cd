//! Images in TraX: a path (`file:///img/0001.jpg`), pixels (`image:640;480;rgb;` and Base64), or
//! the bytes of an image file (`data:image/jpeg;` and Base64).

use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use patchlock_media::{Limits, Picture, Pixels, image_file};

use patchlock_track::names::beginning;

/// The protocol's name for images given by path.
pub const PATH: &str = "path";
/// All supported kinds of images.
pub const FORMATS: [&str; 3] = [PATH, "memory", "buffer"];

/// An image in a message.
#[derive(Debug, Clone, PartialEq)]
pub enum Image {
    /// The path of an image file.
    Path(PathBuf),
    /// The pixels.
    Memory(Picture),
    /// The bytes of an image file.
    Buffer(Vec<u8>),
}

impl Image {
    /// Parses an argument. Files are not opened.
    ///
    /// # Errors
    /// What is wrong with the argument.
    pub fn parse(text: &str) -> Result<Self, String> {
        if let Some(path) = text.strip_prefix("file://").or_else(|| text.strip_prefix("file:")) {
            return Ok(Self::Path(of_address(path, cfg!(windows)).into()));
        }
        if let Some(rest) = text.strip_prefix("image:") {
            return memory(rest).map(Self::Memory);
        }
        if let Some(rest) = text.strip_prefix("data:") {
            let (_, data) =
                rest.split_once(';').ok_or("an image as data has no ; before its data")?;
            // Some programs also write the name of the encoding.
            return bytes(data.strip_prefix("base64,").unwrap_or(data)).map(Self::Buffer);
        }
        match text.split_once("://") {
            Some((scheme, _)) => Err(format!(
                "images by {}:// are not supported; send file:// with a path, pixels, or the bytes of a \
                 file",
                beginning(scheme)
            )),
            None if text.is_empty() => Err("an image without a name".to_string()),
            None => Ok(Self::Path(text.into())),
        }
    }

    /// Reads and decodes the image.
    ///
    /// # Errors
    /// Why the image cannot be read.
    pub fn picture(self) -> Result<Picture, String> {
        match self {
            Self::Memory(picture) => Ok(picture),
            Self::Path(file) => image_file::load(&file)
                .map_err(|error| format!("cannot read the image {}: {error}", shown(&file))),
            Self::Buffer(bytes) => image_file::decode(&bytes, Limits::default())
                .map_err(|error| format!("cannot decode the image: {error}")),
        }
    }

    /// The argument for a file. The path should be absolute, since the other program may run in
    /// another folder.
    pub fn of_path(file: &Path) -> String {
        format!("file://{}", file.display())
    }
}

/// The path in the address of a file: `C:/1.jpg` in `file:///C:/1.jpg`, where there are drives.
fn of_address(path: &str, has_drives: bool) -> &str {
    match path.strip_prefix('/') {
        Some(rest) if has_drives && rest.as_bytes().get(1) == Some(&b':') => rest,
        _ => path,
    }
}

/// The beginning of a path that a client has sent.
fn shown(file: &Path) -> String {
    beginning(&file.to_string_lossy())
}

/// Parses `WIDTH;HEIGHT;FORMAT;DATA`.
fn memory(text: &str) -> Result<Picture, String> {
    let mut parts = text.splitn(4, ';');
    let mut part = |what| parts.next().ok_or(format!("an image in memory has no {what}"));
    let side = |text: &str| {
        let number = text.parse().ok().filter(|&side: &usize| side > 0);
        number.ok_or(format!(
            "an image in memory has the size \"{}\"; it must be an integer of at least 1",
            beginning(text)
        ))
    };
    let (width, height) = (side(part("width")?)?, side(part("height")?)?);
    let (format, data) = (part("format")?, part("data")?);
    let depth = match format {
        "rgb" => 3,
        "gray8" => 1,
        "gray16" => 2,
        other => {
            return Err(format!(
                "an image in memory has the format {}; it must be rgb, gray8 or gray16",
                beginning(other)
            ));
        }
    };
    let data = bytes(data)?;
    if width.checked_mul(height).and_then(|count| count.checked_mul(depth)) != Some(data.len()) {
        return Err(format!(
            "an image in memory of {width} x {height} pixels of {format} has {} bytes; each pixel \
             needs {depth}",
            data.len()
        ));
    }
    let pixels = match depth {
        1 => Pixels::Grey8(data),
        // Both programs run on the same machine, so the byte order is the native one.
        2 => Pixels::Grey16(
            data.as_chunks().0.iter().map(|&pair| u16::from_ne_bytes(pair)).collect(),
        ),
        _ => Pixels::Rgb8(data),
    };
    Ok(Picture::new(width, height, pixels))
}

fn bytes(data: &str) -> Result<Vec<u8>, String> {
    BASE64_STANDARD
        .decode(data)
        .map_err(|error| format!("the image data are not valid Base64: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths() {
        for text in ["file:///a b/1.jpg", "file:/a b/1.jpg", "/a b/1.jpg"] {
            assert_eq!(Image::parse(text), Ok(Image::Path("/a b/1.jpg".into())), "{text}");
        }
        assert_eq!(Image::parse(&Image::of_path(Path::new("/x"))), Ok(Image::Path("/x".into())));
        let missing = Image::Path("/no/such.png".into()).picture().unwrap_err();
        assert!(missing.starts_with("cannot read the image /no/such.png: "), "{missing}");
        if cfg!(unix) {
            let endless = Image::Path("/dev/zero".into()).picture().unwrap_err();
            assert!(endless.ends_with("it is a pipe or a device, not a file"), "{endless}");
        }
    }

    #[test]
    fn an_address_with_a_drive_is_a_path() {
        for (path, on_windows) in [
            ("/C:/a/1.jpg", "C:/a/1.jpg"),
            (r"C:\1.jpg", r"C:\1.jpg"),
            ("/a/b:c", "/a/b:c"),
            ("/", "/"),
        ] {
            assert_eq!(of_address(path, true), on_windows);
            assert_eq!(of_address(path, false), path);
        }
    }

    #[test]
    fn pixels_in_every_depth() {
        let picture = |text: &str| Image::parse(text).and_then(Image::picture).unwrap();
        assert_eq!(picture("image:1;1;rgb;AQID").pixels, Pixels::Rgb8(vec![1, 2, 3]));
        let grey = picture("image:3;1;gray8;AQID");
        assert_eq!((grey.width, grey.height, grey.pixels), (3, 1, Pixels::Grey8(vec![1, 2, 3])));
        let deep = u16::from_ne_bytes([1, 2]);
        assert_eq!(picture("image:1;1;gray16;AQI=").pixels, Pixels::Grey16(vec![deep]));
    }

    #[test]
    fn bytes_of_files() {
        let mut png = std::io::Cursor::new(Vec::new());
        image::GrayImage::from_raw(2, 1, vec![7, 9])
            .unwrap()
            .write_to(&mut png, image::ImageFormat::Png)
            .unwrap();
        let data = BASE64_STANDARD.encode(png.into_inner());
        for head in ["data:image/png;", "data:image/png;base64,"] {
            let picture = Image::parse(&format!("{head}{data}")).and_then(Image::picture).unwrap();
            assert_eq!(picture.pixels, Pixels::Grey8(vec![7, 9]));
        }
    }

    #[test]
    fn errors_name_the_fault() {
        let error = |text: &str| Image::parse(text).and_then(Image::picture).unwrap_err();
        for (text, why) in [
            ("", "without a name"),
            ("http://x/1.jpg", "by http:// are not supported"),
            ("image:2;2;rgb;AQID", "2 x 2 pixels of rgb has 3 bytes; each pixel needs 3"),
            ("image:18446744073709551615;18446744073709551615;rgb;AQID", "has 3 bytes"),
            ("image:0;2;rgb;AQID", "the size \"0\""),
            ("image:1;x;rgb;AQID", "the size \"x\""),
            ("image:1;1;yuv;AQID", "has the format yuv"),
            ("image:1;1", "no format"),
            ("image:1;1;rgb", "no data"),
            ("image:1;1;rgb;?", "not valid Base64"),
            ("data:image/png", "no ;"),
            ("data:image/png;AQID", "cannot decode"),
            ("data:image/png;", "the file is empty"),
        ] {
            assert!(error(text).contains(why), "{text}: {}", error(text));
        }
    }
}
