//! What the caller of a server decides.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use patchlock::TrackerConfig;
use patchlock_media::Limits;
use patchlock_track::files::folder_of;

use super::error::Error;
use super::host::AllowedHosts;
use super::timeouts::Timeouts;
use super::token;
use crate::project;

/// [`Options::strangers`] of a server for people: many, since a page is read without the token, and
/// few enough that files can still be opened.
pub const STRANGERS: usize = 256;

/// What a server needs to know.
#[derive(Debug, Clone)]
pub struct Options {
    /// Videos and folders of images to annotate.
    pub videos: Vec<PathBuf>,
    /// Where the projects of the videos are.
    pub projects: ProjectLocation,
    /// The address to listen on. With port 0 the system chooses a free one.
    pub address: SocketAddr,
    /// The hosts under which the page is read elsewhere, through a proxy for example.
    pub hosts: AllowedHosts,
    /// The settings of the tracker.
    pub config: TrackerConfig,
    /// The number of threads of the tracker; by default one per logical processor.
    pub threads: Option<usize>,
    /// What a video may claim.
    pub limits: Limits,
    /// How long to wait for a client.
    pub timeouts: Timeouts,
    /// Most connections at once that have not shown the token. One more ends the oldest of them.
    pub strangers: usize,
    /// The folder for uploads and recordings, made when it is needed.
    pub uploads: PathBuf,
    /// Largest upload in bytes.
    pub upload_bytes: u64,
    /// Whether the page begins with the camera.
    pub camera: bool,
    /// A folder of the user's own, where the token is kept for a week. A server with the same
    /// address and videos has it again, so pages that are open go on. Without a folder, and if other
    /// machines can reach the server, each one has another token.
    pub tokens: Option<PathBuf>,
}

/// Where the projects of videos are.
#[derive(Debug, Clone)]
pub enum ProjectLocation {
    /// Each beside its video.
    Beside,
    /// All in this folder, which is made if it is missing.
    Folder(PathBuf),
    /// In this file, of the only video.
    File(PathBuf),
}

impl ProjectLocation {
    /// The project file of a video; some files are taken by others.
    pub(super) fn file(&self, video: &Path, is_taken: impl Fn(&Path) -> bool) -> PathBuf {
        match self {
            Self::Beside => project::beside(video, is_taken),
            Self::Folder(folder) => project::in_folder(folder, video, is_taken),
            Self::File(file) => file.clone(),
        }
    }
}

impl Options {
    /// Makes the folder for projects, if there is to be one.
    pub(super) fn make_project_folder(&self) -> Result<(), Error> {
        let ProjectLocation::Folder(folder) = &self.projects else { return Ok(()) };
        let cannot = |reason| Error::Folder { path: folder.clone(), reason };
        std::fs::create_dir_all(folder).map_err(cannot)
    }

    /// The folder of the labels of all clips: that of the projects, or else of uploads.
    pub(super) fn folder(&self) -> PathBuf {
        match self.videos.first() {
            Some(video) => folder_of(&self.projects.file(video, |_| false)).to_path_buf(),
            None => self.uploads.clone(),
        }
    }

    /// The file for the token of a server that listens on this address.
    pub(super) fn token_file(&self, address: SocketAddr) -> Option<PathBuf> {
        let is_local = address.ip().is_loopback() && self.hosts.allowed.is_empty();
        let folder = self.tokens.as_deref().filter(|_| is_local)?;
        let absolute = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone());
        let videos: Vec<PathBuf> = self.videos.iter().map(absolute).collect();
        let projects = match &self.projects {
            ProjectLocation::Beside => None,
            ProjectLocation::Folder(path) | ProjectLocation::File(path) => Some(absolute(path)),
        };
        let uploads = absolute(&self.uploads);
        Some(token::file(folder, &format!("{address} {videos:?} {projects:?} {uploads:?}")))
    }
}
