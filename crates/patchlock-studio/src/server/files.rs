//! Files in and out: videos that are uploaded, boxes that are imported and exported.

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
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::App;
use super::answer::{Arriving, Asked, At, Refusal, aside};
use crate::project::Edit;
use crate::{export, import};

/// Longest name of a file, in characters.
const NAME: usize = 100;
/// Largest table of boxes, in bytes.
const TABLE_BYTES: u64 = 256 << 20;
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
        let mut source = patchlock_media::open_within(&path, false, app.settings.limits)?;
        if source.frame(0)?.is_none() {
            return Err(Refusal::bad(format!("{name} has no frames")));
        }
        let video = keep(path, &folder, &name).map_err(|error| cannot_keep(&folder, &error))?;
        let clip = app.clips.add(&video, None);
        clip.open().map(|_| clip.id).map_err(|error| Refusal::from(&*error))
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

/// In which format a file is.
#[derive(Deserialize)]
pub struct Formatted {
    format: String,
}

/// `POST /api/clips/ID/import?format=NAME`: boxes from another tool, which become new targets.
pub async fn import_boxes(
    State(app): State<Arc<App>>,
    At(clip): At<usize>,
    Asked(Formatted { format }): Asked<Formatted>,
    body: Body,
) -> Result<Json<Value>, Refusal> {
    let clip = app.clips.open(clip).await?;
    let format = import::Format::named(&format)?;
    let text = Arriving::new(body, TABLE_BYTES, app.patience.body)?.whole().await?;
    let added = aside(move || {
        let mut held = clip.hold();
        let targets = import::read(format, &text, held.store.project())?;
        let before = held.store.project().next_id;
        held.store.apply(vec![Edit::Import { targets }])?;
        let revision = clip.announce_and_save(&mut held)?;
        let ids = before..held.store.project().next_id;
        Ok(json!({ "revision": revision, "targets": ids.collect::<Vec<_>>() }))
    });
    added.await.map(Json)
}

/// What to export.
#[derive(Deserialize)]
pub struct Wanted {
    format: String,
    /// Whether folders get the frames, too.
    #[serde(default)]
    frames: bool,
    /// Only every so many-th tracked frame is a key frame.
    #[serde(default = "one")]
    key_frames: usize,
}

fn one() -> usize {
    1
}

/// `GET /api/clips/ID/export?format=NAME`: a file, or a folder as one file.
pub async fn export_boxes(
    State(app): State<Arc<App>>,
    At(clip): At<usize>,
    Asked(Wanted { format, frames, key_frames }): Asked<Wanted>,
) -> Result<Response, Refusal> {
    let clip = app.clips.open(clip).await?;
    let format = export::Format::named(&format)?;
    let stem = stem(&clip.name);
    let options = export::Options {
        format,
        name: stem.clone(),
        frames,
        key_frames,
        limits: app.settings.limits,
    };
    let written = aside(move || {
        let cannot = |error: io::Error| cannot_keep(&std::env::temp_dir(), &error);
        let project = clip.hold().store.project().clone();
        let folder = tempfile::tempdir().map_err(cannot)?;
        let out = folder.path().join("export");
        export::write(&project, &clip.engine.video, &options, &out, false)?;
        let file = NamedTempFile::new().map_err(cannot)?;
        if format.is_file() {
            std::fs::copy(&out, file.path()).map_err(cannot)?;
        } else {
            pack(&out, &options.name, file.as_file()).map_err(cannot)?;
        }
        Ok(file.into_temp_path())
    });
    let (kind, ending) = kind(format);
    download(written.await?, kind, &format!("{stem}.{}.{ending}", format.name())).await
}

/// Content type and ending of the file of a format.
fn kind(format: export::Format) -> (&'static str, &'static str) {
    match format.name() {
        _ if !format.is_file() => ("application/zip", "zip"),
        "csv" => ("text/csv; charset=utf-8", "csv"),
        "mot" => ("text/plain; charset=utf-8", "txt"),
        "cvat" => ("application/xml", "xml"),
        _ => ("application/json", "json"),
    }
}

/// Writes all files below a folder into one, below a folder of this name, without compressing them:
/// pictures are compressed already.
fn pack(folder: &Path, name: &str, out: &std::fs::File) -> io::Result<()> {
    let mut zip = ZipWriter::new(out);
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut folders = vec![(folder.to_path_buf(), name.to_owned())];
    while let Some((folder, inside)) = folders.pop() {
        let mut entries = std::fs::read_dir(&folder)?.collect::<io::Result<Vec<_>>>()?;
        entries.sort_by_key(std::fs::DirEntry::file_name);
        for entry in entries {
            let path = format!("{inside}/{}", entry.file_name().to_string_lossy());
            if entry.file_type()?.is_dir() {
                folders.push((entry.path(), path));
                continue;
            }
            zip.start_file(path, stored)?;
            io::copy(&mut std::fs::File::open(entry.path())?, &mut zip)?;
        }
    }
    zip.finish()?;
    Ok(())
}

/// A name without its ending, fit for the names of files.
pub fn stem(name: &str) -> String {
    let stem = Path::new(name).file_stem().and_then(OsStr::to_str).unwrap_or("clip");
    let plain = plain_name(stem).unwrap_or_default();
    let plain = plain.trim();
    if plain.is_empty() { "clip".to_owned() } else { plain.to_owned() }
}

/// A file as an answer, with a name to keep it under. It is read piece by piece; a temporary one is
/// removed afterwards.
pub async fn download(
    path: impl AsRef<Path> + Send + 'static,
    kind: &'static str,
    name: &str,
) -> Result<Response, Refusal> {
    let cannot = |error: io::Error| Refusal::failed(format!("cannot read the file: {error}"));
    let file = File::open(path.as_ref()).await.map_err(cannot)?;
    let length = file.metadata().await.map_err(cannot)?.len();
    let name = name.replace(|c: char| !(c.is_ascii_alphanumeric() || "-_.".contains(c)), "_");
    let headers = [
        (CONTENT_TYPE, kind.to_owned()),
        (CONTENT_LENGTH, length.to_string()),
        (CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
    ];
    let pieces = stream::try_unfold((file, path), |(mut file, path)| async move {
        let mut piece = Vec::with_capacity(PIECE);
        let count = file.read_buf(&mut piece).await?;
        Ok::<_, io::Error>((count > 0).then(|| (Bytes::from(piece), (file, path))))
    });
    Ok((headers, Body::from_stream(pieces)).into_response())
}
