//! Writes the files of an export under temporary names beside the output, then renames them: the
//! output is complete or does not exist.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use image::codecs::jpeg::JpegEncoder;
use patchlock_media::image_file::LoadError;
use patchlock_media::plain_file::PlainFile;
use patchlock_media::{FrameSource, Limits, Picture, image_file, plain_file};

use super::{Content, Item, Options};
use crate::Error;
use crate::files::folder_of;

/// Quality of JPEGs converted from other formats; no loss is visible.
const JPEG_QUALITY: u8 = 95;

/// Checks that the output can be written, before any work is done. `is_file` tells whether the
/// format is one file.
pub fn check(out: &Path, is_file: bool, overwrite: bool) -> Result<(), Error> {
    let parent = folder_of(out);
    if !parent.is_dir() {
        return Err(Error::Export(format!("there is no folder {}", parent.display())));
    }
    let reason = if is_file {
        match (out.is_dir(), out.exists() && !overwrite) {
            (true, _) => "is a folder; this format is one file",
            (_, true) => "exists already",
            _ => return Ok(()),
        }
    } else {
        let is_used = || fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some());
        match (out.exists() && !out.is_dir(), is_used()) {
            (true, _) => "is a file; this format is a folder",
            (_, true) => "already has files; a folder is never replaced: name another one",
            _ => return Ok(()),
        }
    };
    Err(Error::Export(format!("{} {reason}", out.display())))
}

/// Fails if the export is to stop.
pub fn check_not(stopped: &dyn Fn() -> bool) -> Result<(), Error> {
    match stopped() {
        true => Err(Error::Export("stopped before all files were written".to_string())),
        false => Ok(()),
    }
}

/// Writes a folder of files, each with the reader of its images, unless it is stopped.
pub fn write_folder(
    out: &Path,
    parts: Vec<(Vec<Item>, Reader)>,
    stopped: &dyn Fn() -> bool,
) -> Result<(), Error> {
    let cannot = |error| Error::write(out, error);
    let mut builder = tempfile::Builder::new();
    builder.prefix(".patchlock-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // Those of an ordinary new folder; temporary ones are private by default.
        builder.permissions(fs::Permissions::from_mode(0o777));
    }
    let folder = builder.tempdir_in(folder_of(out)).map_err(cannot)?;
    for (items, mut reader) in parts {
        for item in items {
            check_not(stopped)?;
            let (path, shown) = (folder.path().join(&item.path), out.join(&item.path));
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent).map_err(cannot)?;
            }
            write_item((&path, &shown), &item.content, &mut reader)?;
        }
    }
    // On Unix, renaming replaces an empty folder; elsewhere it has to be removed first.
    if out.is_dir() {
        fs::remove_dir(out).map_err(cannot)?;
    }
    fs::rename(folder.path(), out).map_err(cannot)?;
    let _ = folder.keep(); // it has been renamed, so there is nothing to remove
    Ok(())
}

/// Writes a file at a temporary place; errors name the other one.
fn write_item(
    (path, shown): (&Path, &Path),
    content: &Content,
    reader: &mut Reader,
) -> Result<(), Error> {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    match content {
        Content::Text(text) => fs::write(path, text).map_err(|error| Error::write(shown, error)),
        Content::Copy(from) => {
            let mut image = reader.image(from)?;
            let mut copy = fs::File::create(path).map_err(|error| Error::write(shown, error))?;
            io::copy(&mut image.file, &mut copy).map(drop).map_err(|error| match error.kind() {
                StorageFull | QuotaExceeded | FileTooLarge => Error::write(shown, error),
                _ => Error::read(from, error),
            })
        }
        Content::Jpeg(from) => {
            let picture = image_file::load_from(reader.image(from)?, reader.limits)
                .map_err(|error| Error::frame(from, error))?;
            write_jpeg((path, shown), &picture)
        }
        Content::Frame(from, index) => write_jpeg((path, shown), &reader.frame_of(from, *index)?),
    }
}

/// Reads images, and frames of a video.
pub struct Reader {
    limits: Limits,
    /// The folder that links must not leave.
    within: Option<PathBuf>,
    /// The video, and the number of the next frame that can be read from it.
    video: Option<(Box<dyn FrameSource>, usize)>,
}

impl Reader {
    /// Reads what these options name.
    pub fn new(options: &Options) -> Result<Self, Error> {
        let folder = options.images.as_ref().filter(|_| !options.follow_links);
        let real =
            |folder: &PathBuf| folder.canonicalize().map_err(|error| Error::read(folder, error));
        let within = folder.map(real).transpose()?;
        Ok(Self { limits: options.limits, within, video: None })
    }

    /// Opens an image. What has not the header of one is none, whatever its name.
    fn image(&self, path: &Path) -> Result<PlainFile, Error> {
        let target = path.canonicalize().map_err(|error| Error::read(path, error))?;
        if self.within.as_ref().is_some_and(|folder| !target.starts_with(folder)) {
            return Err(Error::LinkOutside(path.to_path_buf(), target));
        }
        let cannot = |error: LoadError| Error::frame(path, error);
        let mut image = plain_file::open(&target).map_err(|error| cannot(error.into()))?;
        image_file::size_of(&mut image).map_err(cannot)?;
        Ok(image)
    }

    /// The frame of a video. It is opened anew for a frame that was passed.
    fn frame_of(&mut self, from: &Path, index: usize) -> Result<Picture, Error> {
        let mut source = match self.video.take().filter(|(_, next)| *next <= index) {
            Some((source, _)) => source,
            None => patchlock_media::open_within(from, false, self.limits)?,
        };
        let picture = source.frame(index)?.ok_or_else(|| {
            Error::Export(format!(
                "the track has boxes in frame {index}, counted from 0, but {} ends before it",
                from.display()
            ))
        })?;
        self.video = Some((source, index + 1));
        Ok(picture)
    }
}

fn write_jpeg((path, shown): (&Path, &Path), picture: &Picture) -> Result<(), Error> {
    let file = fs::File::create(path).map_err(|error| Error::write(shown, error))?;
    let mut out = std::io::BufWriter::new(file);
    let (width, height) = (picture.width as u32, picture.height as u32);
    let colour = image::ExtendedColorType::Rgb8;
    JpegEncoder::new_with_quality(&mut out, JPEG_QUALITY)
        .encode(&picture.to_rgb(), width, height, colour)
        .map_err(|error| Error::write(shown, io::Error::other(error)))?;
    out.flush().map_err(|error| Error::write(shown, error))
}
