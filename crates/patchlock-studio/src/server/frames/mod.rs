//! Single frames as JPEG, whatever the video's encoding.
//!
//! Each clip has two decoders: one for the frames that a person looks at, which also prepares the
//! neighbours, and one for thumbnails, which must not disturb the position of the first in the
//! video. All clips share one cache.

mod cache;
mod decoder;
mod source;

use std::path::Path;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use patchlock_media::{Limits, Picture};
use serde::Deserialize;
use tokio::sync::oneshot;

use super::answer::{PathParam, QueryParams, Refusal};
use super::app::App;
use super::lock;
use cache::Key;
use decoder::{Decoder, Job, Request};

pub use cache::Cache;

/// A frame of at most this width is a thumbnail.
const THUMBNAIL: u32 = 320;
/// Quality of the JPEG: artefacts must not hide where a target ends.
const QUALITY: u8 = 88;

/// Encodes a picture for the page. A width narrower than the picture's scales it down; 0 stands for
/// its own.
pub fn jpeg(picture: &Picture, width: u32) -> Result<Vec<u8>, Refusal> {
    let encoded = patchlock_media::jpeg::encode(picture, width, QUALITY);
    encoded.map_err(|error| Refusal::failed(format!("cannot encode: {error}")))
}

/// Reads frames of one clip.
pub struct Reader {
    clip: usize,
    cache: Arc<Cache>,
    viewed: Decoder,
    thumbnails: Decoder,
}

impl Reader {
    pub fn new(path: &Path, limits: Limits, frames: usize, clip: usize, cache: Arc<Cache>) -> Self {
        let decoder = |prepares| {
            let (path, cache) = (path.to_path_buf(), Arc::clone(&cache));
            Decoder::start(Job { path, limits, frames, cache, prepares })
        };
        Self { clip, viewed: decoder(true), thumbnails: decoder(false), cache }
    }

    /// A frame as JPEG, of this width if the frame is wider; 0 stands for its own.
    async fn jpeg(&self, frame: usize, width: u32) -> Result<Bytes, Refusal> {
        let key = Key { clip: self.clip, frame, width };
        let is_thumbnail = (1..=THUMBNAIL).contains(&width);
        if let Some(jpeg) = self.cache.get(key) {
            if !is_thumbnail {
                self.viewed.ask(Request { key, answer: None });
            }
            return Ok(jpeg);
        }
        let (answer, wait) = oneshot::channel();
        let decoder = if is_thumbnail { &self.thumbnails } else { &self.viewed };
        decoder.ask(Request { key, answer: Some(answer) });
        wait.await.unwrap_or_else(|_| Err(Refusal::failed("the decoder has ended")))
    }
}

/// How a frame is wanted.
#[derive(Deserialize)]
pub struct Size {
    #[serde(default)]
    width: u32,
}

/// `GET /api/clips/ID/frames/N?width=W`
pub async fn frame(
    State(app): State<Arc<App>>,
    PathParam((clip, frame)): PathParam<(usize, usize)>,
    QueryParams(Size { width }): QueryParams<Size>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let video = app.clips.open(clip).await?;
    if frame >= video.frames {
        return Err(no_frame(frame, video.frames));
    }
    // All widths from the frame's own on are the same picture.
    let width = if (width as usize) < video.width { width } else { 0 };
    // The token changes with each start of the program: the file may have changed in between.
    let tag = format!("\"{}-{}-{frame}-{width}\"", app.access.session, clip);
    let caching = [(ETAG, tag.clone()), (CACHE_CONTROL, "private, max-age=3600, immutable".into())];
    if headers.get(IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes()) {
        return Ok((StatusCode::NOT_MODIFIED, caching).into_response());
    }
    let jpeg = video.reader.jpeg(frame, width).await?;
    Ok(([(CONTENT_TYPE, "image/jpeg")], caching, jpeg).into_response())
}

fn no_frame(frame: usize, frames: usize) -> Refusal {
    Refusal::unknown(format!("there is no frame {frame}; the video has {frames} frames, from 0"))
}
