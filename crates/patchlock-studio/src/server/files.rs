//! Files in and out: videos that are uploaded, boxes that are imported and exported.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use axum::Json;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::HeaderValue;
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_LENGTH, CONTENT_TYPE};
use axum::response::{IntoResponse as _, Response};
use futures_util::stream;
use patchlock::Status;
use patchlock_media::Limits;
use patchlock_track::export::{ExportSummary, Format, KeyFrames, Options, Selection};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use tempfile::{NamedTempFile, TempPath};
use tokio::fs::File;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::answer::{BodyReader, JsonAnswer, QueryParams, Refusal, aside};
use super::app::App;
use super::clips::{ClipRequest, Clips, OpenClip};
use super::options::ProjectLocation;
use crate::import::ImportResult;
use crate::project::{Attribute, Project, Target, Video, check};
use crate::{export, import, project};

/// Longest name of a file, in characters.
const NAME: usize = 100;
/// Largest table of boxes, in bytes.
const TABLE_BYTES: u64 = 256 << 20;
/// Bytes of a file that are read at once.
const PIECE: usize = 256 << 10;

/// How an uploaded file is called.
#[derive(Deserialize)]
pub struct UploadQuery {
    name: String,
}

/// `POST /api/clips?name=NAME`: a video, which becomes a clip.
pub async fn upload(
    State(app): State<Arc<App>>,
    QueryParams(UploadQuery { name }): QueryParams<UploadQuery>,
    body: Body,
) -> JsonAnswer {
    let mut pieces = BodyReader::new(body, app.options.upload_bytes, app.options.timeouts.body)?;
    let name = plain_name(&name)?;
    let folder = app.options.uploads.clone();
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
        let mut source = patchlock_media::open_within(&path, false, app.options.limits)?;
        if source.frame(0)?.is_none() {
            return Err(Refusal::bad(format!("{name} has no frames")));
        }
        let video = keep(path, &folder, &name).map_err(|error| cannot_keep(&folder, &error))?;
        let clip = app.clips.add(&video, &ProjectLocation::Beside);
        clip.open().map_err(|error| Refusal::from(&*error))?;
        Ok(json!({ "id": clip.id }))
    });
    clip.await.map(Json)
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
pub struct ImportQuery {
    format: String,
    /// Whether only to say what it would add.
    #[serde(default)]
    preview: bool,
}

/// `POST /api/clips/ID/import?format=NAME`: boxes from another tool, which become new targets; with
/// `preview=true`, only what would be added.
pub async fn import_boxes(
    QueryParams(ImportQuery { format, preview }): QueryParams<ImportQuery>,
    ClipRequest { app, clip }: ClipRequest,
    body: Body,
) -> JsonAnswer {
    let format = import::Format::named(&format)?;
    let content = BodyReader::new(body, TABLE_BYTES, app.options.timeouts.body)?.whole().await?;
    let files = match format.has_files() {
        true => files_of(&content)?,
        false => vec![import::File { name: String::new(), content }],
    };
    let images = import::names_of(&clip.engine.video);
    let read = move |project: &Project| import::read_files(format, &files, project, &images);
    if preview {
        return aside(move || preview_of(&clip, read)).await.map(Json);
    }
    aside(move || add(&app.clips, &clip, read)).await.map(Json)
}

/// The files of a format that has several, which are sent as a JSON object of texts by name.
fn files_of(content: &[u8]) -> Result<Vec<import::File>, Refusal> {
    let texts: BTreeMap<String, String> = serde_json::from_slice(content)
        .map_err(|error| Refusal::bad(format!("the files are not an object of texts: {error}")))?;
    let file = |(name, text): (String, String)| import::File { name, content: text.into_bytes() };
    Ok(texts.into_iter().map(file).collect())
}

/// Says what an import would add, without adding it.
fn preview_of(
    clip: &OpenClip,
    read: impl FnOnce(&Project) -> Result<ImportResult, project::Error>,
) -> Result<Value, Refusal> {
    let known = clip.hold().store.project().clone();
    let ImportResult { targets: found, declared, notes } = read(&known.without_targets())?;
    let frames = |target: &Target| target.keys.len() + target.tracked.len();
    let mut labels = Vec::new();
    found.iter().for_each(|target| import::count(&mut labels, &target.label));
    let is_new = |name: &str| !known.labels.iter().any(|label| label.name == name);
    let labels: Vec<Value> = labels
        .into_iter()
        .map(|(name, targets)| json!({ "name": name, "targets": targets, "new": is_new(&name) }))
        .collect();
    // The same box in the same frame: a file that is imported twice.
    let is_there = |target: &&Target| {
        let first = target.keys.keys().chain(target.tracked.keys()).min();
        let Some(frame) = first else { return false };
        let same = |other: &Target| {
            other.box_at(*frame).is_some() && other.box_at(*frame) == target.box_at(*frame)
        };
        known.targets.iter().any(same)
    };
    let span = found.iter().flat_map(|target| target.keys.keys().chain(target.tracked.keys()));
    Ok(json!({
        "targets": found.len(),
        "keys": found.iter().map(|target| target.keys.len()).sum::<usize>(),
        "boxes": found.iter().map(frames).sum::<usize>(),
        "first": span.clone().min(),
        "last": span.max(),
        "labels": labels,
        "attributes": new_attributes(&known, &declared),
        "there": found.iter().filter(is_there).count(),
        "notes": notes,
        "proposals": found.iter().filter_map(|it| proposal(it, &known.video)).collect::<Vec<_>>(),
    }))
}

/// The first box of a target that a person could have drawn, with its score if it has one, for the
/// person to decide whether it is one.
fn proposal(target: &Target, video: &Video) -> Option<Value> {
    let keys = target.keys.iter().map(|(frame, key)| (*frame, key.bbox, None));
    let tracked = target.tracked.iter().filter(|(_, tracked)| tracked.status != Status::Lost);
    let tracked = tracked.map(|(frame, tracked)| (*frame, tracked.bbox, Some(tracked.score)));
    let boxes = keys.chain(tracked).filter(|(_, bbox, _)| check::drawn_box(*bbox, video).is_ok());
    let (frame, bbox, score) = boxes.min_by_key(|(frame, ..)| *frame)?;
    Some(json!({ "frame": frame, "label": target.label, "box": bbox, "score": score }))
}

/// The names of attributes that labels would declare from then on.
fn new_attributes(known: &Project, declared: &BTreeMap<String, Vec<Attribute>>) -> Value {
    let mut all = Map::new();
    for (label, attributes) in declared {
        let is_new = |it: &&Attribute| known.declared(label).iter().all(|old| old.name != it.name);
        let new: Vec<&str> = attributes.iter().filter(is_new).map(|it| &*it.name).collect();
        if !new.is_empty() {
            all.insert(label.clone(), new.into());
        }
    }
    all.into()
}

/// Adds the targets that `read` finds. It may take long, so it sees a copy of the project, and the
/// clip is not held meanwhile.
fn add(
    clips: &Clips,
    clip: &OpenClip,
    read: impl FnOnce(&Project) -> Result<ImportResult, project::Error>,
) -> Result<Value, Refusal> {
    let known = clip.hold().store.project().without_targets();
    let (revision, ids) = clips.import(clip, read(&known)?)?;
    Ok(json!({ "revision": revision, "targets": ids }))
}

/// `GET /api/formats`: the formats of exports and of imports.
pub async fn formats() -> Json<Value> {
    let export = |format: Format| {
        json!({
            "name": format.name,
            "title": format.title,
            "content": format.content,
            "folder": !format.is_file(),
            "key_frames": format.has_key_frames,
        })
    };
    let exports: Vec<Value> = Format::all(true).map(export).collect();
    let import = |format: import::Format| json!({ "name": format.name(), "title": format.title(), "files": format.has_files() });
    Json(json!({ "exports": exports, "imports": import::Format::ALL.map(import) }))
}

/// What to export.
#[derive(Deserialize)]
pub struct ExportQuery {
    format: String,
    /// Whether folders get the frames, too.
    #[serde(default)]
    frames: bool,
    /// Every so many-th tracked frame is a key frame, or the least overlap.
    #[serde(default = "one")]
    key_frames: f64,
    /// Statuses with commas between them; empty for those of the format.
    #[serde(default)]
    status: String,
    /// The least score.
    #[serde(default)]
    min_score: Option<f64>,
    /// Only every so many-th frame; formats with key frames have all.
    #[serde(default = "first")]
    every: usize,
    /// Clips for validation: a share, or names. For all clips only.
    #[serde(default)]
    val: String,
}

fn one() -> f64 {
    1.0
}

fn first() -> usize {
    1
}

impl ExportQuery {
    fn options(&self, name: String, limits: Limits) -> Result<Options, Refusal> {
        let format = Format::named(&self.format, true)?;
        let status = Some(&self.status).filter(|status| !status.trim().is_empty());
        let status = status.map(|status| Selection::statuses(status)).transpose();
        let selection = Selection { status: status?, min_score: self.min_score, every: self.every };
        let key_frames = KeyFrames::of(self.key_frames)?;
        Ok(Options { selection, key_frames, limits, ..Options::new(format, name) })
    }
}

/// What an export of boxes says of them, in the header of its answer.
const REMARKS: &str = "patchlock-remarks";

/// `GET /api/clips/ID/export?format=NAME`: a file, or a folder as one file.
pub async fn export_boxes(
    QueryParams(query): QueryParams<ExportQuery>,
    ClipRequest { app, clip }: ClipRequest,
) -> Result<Response, Refusal> {
    let options = query.options(stem(&clip.name), app.options.limits)?;
    let video = &clip.engine.video;
    let images = export::reads(&options.format, query.frames, video).then(|| video.clone());
    let options = Options { images, ..options };
    let write = move |options: &Options, out: &Path| {
        let project = clip.hold().store.project().clone();
        Ok(export::write(&project, options, out, false)?)
    };
    let ending = options.format.ending().unwrap_or("zip");
    exported(options, ending, write).await
}

/// `GET /api/export?format=NAME&val=SHARE`: all clips as one data set, a folder as one file.
pub async fn export_all(
    State(app): State<Arc<App>>,
    QueryParams(query): QueryParams<ExportQuery>,
) -> Result<Response, Refusal> {
    let options = query.options("clips".to_owned(), app.options.limits)?;
    let val = export::Val::named(&query.val);
    let write = move |options: &Options, out: &Path| {
        let labels = app.clips.labels()?;
        let clips = of_all(&app.clips, query.frames)?;
        let all = export::write_all(&clips, &labels, options, val.as_ref(), out, &|| false)?;
        Ok(all.written)
    };
    exported(options, "zip", write).await
}

/// What is written, a file or a folder, as one file with this ending. A header has what the export has
/// left out, and what is doubtful.
async fn exported(
    options: Options,
    ending: &'static str,
    write: impl FnOnce(&Options, &Path) -> Result<ExportSummary, Refusal> + Send + 'static,
) -> Result<Response, Refusal> {
    let name = format!("{}.{}.{ending}", options.name, options.format.name);
    let written = aside(move || {
        let cannot = |error: io::Error| cannot_keep(&std::env::temp_dir(), &error);
        let folder = tempfile::tempdir().map_err(cannot)?;
        let out = folder.path().join("export");
        let written = write(&options, &out)?;
        let file = NamedTempFile::new().map_err(cannot)?;
        match out.is_dir() {
            true => pack(&out, &options.name, file.as_file()).map_err(cannot)?,
            false => drop(std::fs::copy(&out, file.path()).map_err(cannot)?),
        }
        Ok((file.into_temp_path(), written))
    });
    let (file, written) = written.await?;
    let mut answer = download(Box::new(file), kind(ending), &name).await?;
    let remarks = written.remarks().join("; ");
    if let Ok(remarks) = HeaderValue::from_str(&remarks)
        && !remarks.is_empty()
    {
        answer.headers_mut().insert(REMARKS, remarks);
    }
    Ok(answer)
}

/// All clips of the page, under names that differ, with the frames or with boxes only. One that
/// cannot be opened is an error: a data set without it would look complete.
fn of_all(clips: &Clips, frames: bool) -> Result<Vec<export::FolderClip>, Refusal> {
    let mut names = BTreeSet::new();
    let mut all = Vec::new();
    for clip in clips.all() {
        let opened = clip.open().map_err(|error| Refusal::from(&*error))?;
        let stem = stem(&opened.name);
        let mut tries = (1..).map(|k| if k == 1 { stem.clone() } else { format!("{stem}-{k}") });
        let name = tries.find(|name| names.insert(name.clone())).unwrap_or_default();
        let project = opened.hold().store.project().clone();
        let video = frames.then(|| opened.engine.video.clone());
        all.push(export::FolderClip { name, project, video });
    }
    Ok(all)
}

/// Content type of files with this ending.
fn kind(ending: &str) -> &'static str {
    match ending {
        "csv" => "text/csv; charset=utf-8",
        "json" => "application/json",
        "xml" => "application/xml",
        "zip" => "application/zip",
        _ => "text/plain; charset=utf-8",
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
    path: Box<dyn AsRef<Path> + Send>,
    kind: &'static str,
    name: &str,
) -> Result<Response, Refusal> {
    let opened = aside(move || {
        let cannot = |error: io::Error| Refusal::failed(format!("cannot read the file: {error}"));
        let file = std::fs::File::open((*path).as_ref()).map_err(cannot)?;
        let length = file.metadata().map_err(cannot)?.len();
        Ok((File::from_std(file), length, path))
    });
    let (file, length, path) = opened.await?;
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

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::time::Duration;

    use axum::http::{Method, Request};
    use patchlock::{BoundingBox, Preset, TrackerConfig};

    use super::super::{AllowedHosts, InProcessServer, Options, STRANGERS, Server, Timeouts};
    use super::*;
    use crate::project::Key;

    /// How long a test waits before it fails.
    const LONG: Duration = Duration::from_secs(60);

    fn server(folder: &Path) -> InProcessServer {
        let frames = folder.join("frames");
        std::fs::create_dir(&frames).expect("creates");
        for k in 0..3 {
            image::GrayImage::new(32, 32).save(frames.join(format!("{k}.png"))).expect("writes");
        }
        let options = Options {
            videos: vec![frames],
            projects: ProjectLocation::Beside,
            hosts: AllowedHosts { allowed: Vec::new(), advice: "" },
            address: ([127, 0, 0, 1], 0).into(),
            config: TrackerConfig::from(Preset::Robust),
            threads: Some(1),
            limits: patchlock_media::Limits::default(),
            timeouts: Timeouts::default(),
            strangers: STRANGERS,
            uploads: folder.join("uploads"),
            upload_bytes: 1,
            camera: false,
            tokens: None,
        };
        Server::open(&options).expect("starts").in_process()
    }

    async fn status(server: &InProcessServer, method: Method, path: &str, body: &str) -> u16 {
        let access = &server.app.access;
        let shown = access.url(false, "");
        let host = shown.trim_start_matches("http://").trim_end_matches("/#");
        let request = Request::builder()
            .method(method)
            .uri(path)
            .header("host", host)
            .header("authorization", format!("Bearer {}", access.token))
            .body(Body::from(body.to_owned()));
        let answer = server.answer(request.expect("is a request"));
        tokio::time::timeout(LONG, answer).await.expect("is answered").status().as_u16()
    }

    #[test]
    fn an_import_that_is_read_for_long_keeps_nobody_waiting() {
        let folder = tempfile::tempdir().expect("a folder");
        let server = server(folder.path());
        let clip = server.app.clips.get(1).expect("is there").open().expect("opens");
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
        let runtime = runtime.expect("threads");
        let (begun, has_begun) = mpsc::channel();
        let (go_on, may_go_on) = mpsc::channel::<()>();
        let bbox = BoundingBox { x: 1.0, y: 1.0, w: 9.0, h: 9.0 };
        let app = Arc::clone(&server.app);
        let import = runtime.spawn(aside(move || {
            add(&app.clips, &clip, |project| {
                begun.send(()).expect("is waited for");
                may_go_on.recv_timeout(LONG).expect("goes on");
                let key = Key::new(bbox);
                let label = project.labels[0].name.clone();
                let keys = [(0, key)].into();
                let (attributes, changes, tracked, hidden) = Default::default();
                let target = Target { id: 1, label, attributes, changes, keys, tracked, hidden };
                Ok(ImportResult { targets: vec![target], ..ImportResult::default() })
            })
        }));
        has_begun.recv_timeout(LONG).expect("begins");
        runtime.block_on(async {
            for path in
                ["/api/clips", "/api/clips/1", "/api/clips/1/doubts", "/api/clips/1/frames/0"]
            {
                assert_eq!(status(&server, Method::GET, path, "").await, 200, "{path}");
            }
            let edit = r#"{"revision": 0, "edits": [{"edit": "add_label", "name": "car"}]}"#;
            assert_eq!(status(&server, Method::POST, "/api/clips/1/edits", edit).await, 200);
        });
        // What Ctrl-C does.
        let (ended, has_ended) = mpsc::channel();
        let ending = std::thread::spawn(move || {
            let closed = server.app.clips.close();
            ended.send(()).expect("is waited for");
            (server, closed)
        });
        has_ended.recv_timeout(LONG).expect("ends while the file is read");
        go_on.send(()).expect("is waited for");
        let (server, closed) = ending.join().expect("ends");
        assert!(closed.0.is_empty() && closed.1.is_empty());
        let added = runtime.block_on(import).expect("ends").expect("is added");
        assert_eq!(added["targets"], json!([1]));
        drop(server);
    }
}
