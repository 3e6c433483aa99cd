//! Files in and out: videos that are uploaded.

use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use axum::Json;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_LENGTH, CONTENT_TYPE};
use axum::response::{IntoResponse as _, Response};
use futures_util::stream;
use serde::Deserialize;
use serde_json::{Value, json};
use tempfile::{NamedTempFile, TempPath};
use tokio::fs::File;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

use super::App;
use super::answer::{Arriving, Asked, Refusal, aside};

/// Longest name of a file, in characters.
const NAME: usize = 100;
/// Bytes of a file that are read at once.
const PIECE: usize = 256 << 10;

/// How an uploaded file is called.
#[derive(Deserialize)]
pub struct Named {
    name: String,
}

/// `POST /api/clips?name=NAME`: a video, which becomes a clip.
pub async fn upload(
    State(app): State<Arc<App>>,
    Asked(Named { name }): Asked<Named>,
    body: Body,
) -> Result<Json<Value>, Refusal> {
    let mut pieces = Arriving::new(body, app.upload_bytes, app.patience.body)?;
    let name = plain_name(&name)?;
    let folder = app.uploads.clone();
    let file = aside({
        let (folder, name) = (folder.clone(), name.clone());
        move || begin(&folder, &name).map_err(|error| cannot_keep(&folder, &error))
    });
    let (file, path) = file.await?.into_parts();
    let mut file = File::from_std(file);
    // If this fails or the client goes away, the file is removed with `path`.
    while let Some(piece) = pieces.next().await? {
        file.write_all(&piece).await.map_err(|error| cannot_keep(&folder, &error))?;
    }
    file.sync_all().await.map_err(|error| cannot_keep(&folder, &error))?;
    drop(file);
    let clip = aside(move || {
        let mut source =
            patchlock_media::open_within(&path.to_string_lossy(), false, app.settings.limits)?;
        if source.frame(0)?.is_none() {
            return Err(Refusal::bad(format!("{name} has no frames")));
        }
        let video = keep(path, &folder, &name).map_err(|error| cannot_keep(&folder, &error))?;
        let clip = app.clips.add(&video, None);
        clip.open().map(|_| clip.id)
    });
    Ok(Json(json!({ "id": clip.await? })))
}

/// The name of a file without anything that has a meaning in a path or a shell.
fn plain_name(name: &str) -> Result<String, Refusal> {
    let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let plain = |c: char| if c.is_alphanumeric() || "-_. ".contains(c) { c } else { '_' };
    let name: String = last.trim().trim_start_matches('.').chars().map(plain).collect();
    let length = name.chars().count();
    if length == 0 || length > NAME {
        let message = format!("the name of the file has {length} characters; allowed: 1 to {NAME}");
        return Err(Refusal::bad(message));
    }
    Ok(name)
}

/// A file for what arrives, with the ending of the name, by which images are recognised.
fn begin(folder: &Path, name: &str) -> io::Result<NamedTempFile> {
    std::fs::create_dir_all(folder)?;
    let ending = Path::new(name).extension().and_then(OsStr::to_str).unwrap_or("part");
    tempfile::Builder::new().prefix(".upload-").suffix(&format!(".{ending}")).tempfile_in(folder)
}

/// Gives a complete file its name, or one with a number if there is such a file.
pub fn keep(mut file: TempPath, folder: &Path, name: &str) -> io::Result<PathBuf> {
    let path = Path::new(name);
    let stem = path.file_stem().and_then(OsStr::to_str).unwrap_or(name);
    let ending = path.extension().and_then(OsStr::to_str);
    for number in 1.. {
        let stem = if number == 1 { stem.to_owned() } else { format!("{stem}-{number}") };
        let name = ending.map_or(stem.clone(), |ending| format!("{stem}.{ending}"));
        let kept = folder.join(name);
        match file.persist_noclobber(&kept) {
            Ok(()) => return Ok(kept),
            Err(failed) if failed.error.kind() == io::ErrorKind::AlreadyExists => {
                file = failed.path;
            }
            Err(failed) => return Err(failed.error),
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// The answer if a file cannot be written.
pub fn cannot_keep(folder: &Path, error: &io::Error) -> Refusal {
    Refusal::failed(format!("cannot write to {}: {error}", folder.display()))
        .hint("check the folder and the disk")
}

/// A file as an answer, with a name to keep it under. It is read piece by piece.
pub async fn download(path: PathBuf, kind: &'static str, name: &str) -> Result<Response, Refusal> {
    let cannot = |error: io::Error| Refusal::failed(format!("cannot read the file: {error}"));
    let file = File::open(&path).await.map_err(cannot)?;
    let length = file.metadata().await.map_err(cannot)?.len();
    let name = name.replace(|c: char| !(c.is_ascii_alphanumeric() || "-_.".contains(c)), "_");
    let headers = [
        (CONTENT_TYPE, kind.to_owned()),
        (CONTENT_LENGTH, length.to_string()),
        (CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
    ];
    let pieces = stream::try_unfold(file, |mut file| async move {
        let mut piece = Vec::with_capacity(PIECE);
        let count = file.read_buf(&mut piece).await?;
        Ok::<_, io::Error>((count > 0).then(|| (Bytes::from(piece), file)))
    });
    Ok((headers, Body::from_stream(pieces)).into_response())
}
