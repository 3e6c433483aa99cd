//! What is known of a project's video, and whether it has changed.

use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::{Component, Path, PathBuf};

use patchlock_media::{Limits, Note};
use patchlock_track::files;
use sha2::{Digest as _, Sha256};

use super::{Error, Video};

/// The length of a piece of a long file that is hashed.
const PIECE: u64 = 1 << 20;
/// The number of pieces. A file that is not longer than all of them is hashed whole.
const PIECES: u64 = 64;

impl Video {
    /// Describes a video for a project file in this folder. Reads the first frame, and all of them
    /// if neither the file nor its packets say how many there are. A video that claims more than
    /// the limits is refused. Returns also what a user should know of the frames.
    ///
    /// # Errors
    /// [`Error::Track`] if it cannot be read or has no frames.
    pub fn describe(
        video: &Path,
        folder: &Path,
        limits: Limits,
    ) -> Result<(Self, Vec<Note>), Error> {
        let (bytes, hash) = fingerprint(video).map_err(|error| Error::read(video, error))?;
        let mut source = patchlock_media::open_within(video, false, limits)?;
        let unreadable =
            || Error::read(video, io::Error::new(io::ErrorKind::InvalidData, "it has no frames"));
        let frames = source.count()?;
        let first = source.frame(0)?.ok_or_else(unreadable)?;
        let path = relative(video, folder).map_err(|error| Error::read(video, error))?;
        let (width, height) = (first.width, first.height);
        Ok((Self { path, bytes, hash, frames, width, height }, source.notes()))
    }

    /// How the video now differs, in words; `None` if it is the same.
    pub fn change(&self, video: &Path) -> Option<String> {
        let differs = size(video).and_then(|now| {
            if now != self.bytes {
                let before = self.bytes;
                return Ok(Some(format!("it had {before} bytes, and now has {now}")));
            }
            let (_, hash) = fingerprint(video)?;
            let is_same = hash.eq_ignore_ascii_case(&self.hash);
            Ok((!is_same).then(|| "it has the same size, but other content".to_owned()))
        });
        match differs {
            Ok(how) => how.map(|how| format!("the video has changed: {how}")),
            Err(error) => Some(unreadable(&error)),
        }
    }
}

/// What is said of a video that is not there, or cannot be read, for this reason.
pub fn unreadable(reason: &dyn Display) -> String {
    format!("the video cannot be read: {reason}")
}

fn other(error: patchlock_track::Error) -> io::Error {
    io::Error::other(error.to_string())
}

/// The size in bytes of a file, or of the images of a folder.
fn size(video: &Path) -> io::Result<u64> {
    if !video.is_dir() {
        return Ok(fs::metadata(video)?.len());
    }
    let images = files::images(video).map_err(other)?;
    images.iter().map(|image| Ok(fs::metadata(image)?.len())).sum()
}

/// The size, and the hash in hexadecimal digits.
fn fingerprint(video: &Path) -> io::Result<(u64, String)> {
    let mut hash = Sha256::new();
    let bytes = match video.is_dir() {
        true => hash_folder(video, &mut hash)?,
        false => hash_file(video, &mut hash)?,
    };
    Ok((bytes, hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()))
}

fn hash_folder(folder: &Path, hash: &mut Sha256) -> io::Result<u64> {
    let mut all = 0;
    for image in files::images(folder).map_err(other)? {
        let bytes = fs::metadata(&image)?.len();
        hash.update(format!("{} {bytes}\n", files::name_of(&image)));
        all += bytes;
    }
    Ok(all)
}

fn hash_file(path: &Path, hash: &mut Sha256) -> io::Result<u64> {
    let bytes = fs::metadata(path)?.len();
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is a pipe or a device"));
    }
    let mut file = File::open(path)?;
    let mut piece = Vec::new();
    let whole = bytes <= PIECE * PIECES;
    let pieces = if whole { bytes.div_ceil(PIECE) } else { PIECES };
    for k in 0..pieces {
        // Of a long file, the first piece is at the beginning and the last at the end.
        let start = match whole {
            true => k * PIECE,
            false => (u128::from(bytes - PIECE) * u128::from(k) / u128::from(PIECES - 1)) as u64,
        };
        file.seek(SeekFrom::Start(start))?;
        piece.clear();
        (&file).take(PIECE).read_to_end(&mut piece)?;
        hash.update(&piece);
    }
    Ok(bytes)
}

/// The path of a file as seen from a folder, with `/` between its parts.
pub fn relative(file: &Path, folder: &Path) -> io::Result<PathBuf> {
    let (file, folder) = (file.canonicalize()?, folder.canonicalize()?);
    let (file_parts, folder_parts): (Vec<_>, Vec<_>) =
        (file.components().collect(), folder.components().collect());
    let same = file_parts.iter().zip(&folder_parts).take_while(|(a, b)| a == b).count();
    // Nothing leads from one drive to another.
    if file_parts[..same].iter().all(|part| matches!(part, Component::Prefix(_))) {
        return Ok(dunce::simplified(&file).to_path_buf());
    }
    let not_text = || {
        let reason = "its path is not text in UTF-8, which a project needs: rename it";
        io::Error::new(io::ErrorKind::InvalidInput, reason)
    };
    let up = folder_parts[same..].iter().map(|_| Some(".."));
    let down = file_parts[same..].iter().map(|part| part.as_os_str().to_str());
    let parts = up.chain(down).collect::<Option<Vec<_>>>().ok_or_else(not_text)?;
    Ok(PathBuf::from(parts.join("/")))
}
