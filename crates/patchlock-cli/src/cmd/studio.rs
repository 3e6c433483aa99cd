//! `patchlock studio`: annotates videos on a page in the browser.

use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use etcetera::BaseStrategy as _;
use patchlock_media::{Helper, Limits};
use patchlock_studio::project;
use patchlock_studio::server::{self, Options, ProjectLocation, Server, Timeouts};
use patchlock_track::files;

use super::page::PageArgs;
use super::settings::SettingsArgs;
use super::{LimitArgs, THREADS_SHOWN, positive, threads};
use crate::failure::{Failure, failed, say, usage};
use crate::interrupt;
use crate::output::printed::print;
use crate::{advice, browser};

/// The endings of videos in a folder of clips.
const VIDEOS: [&str; 10] = ["mp4", "m4v", "mov", "avi", "mkv", "webm", "y4m", "mpg", "mpeg", "ts"];

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock studio clip.mp4
      opens the page in the browser; draw a box, press t, and correct where the
      track is wrong
  patchlock studio clips/*.mp4
      several clips, each with its own project
  patchlock studio frames/
      a folder of images as one clip
  patchlock studio --port 8000 --no-open clip.mp4
      only prints the address, for a browser that you open yourself
  patchlock studio --projects annotations/ /share/clips/*.mp4
      writes nothing to the folder of the clips";

/// Annotates videos on a page in the browser: one drawn box becomes a track
///
/// The program serves the page to browsers on this machine; frames stay on it. The printed address
/// contains a token: anyone who has it can see and change the annotations. The browser is started
/// with another address, which works once and for two minutes, because other users of this machine
/// can read the arguments of programs. Ctrl-C ends the program. Started again with the same videos and
/// --port within a week, it has the same token, and pages that are still open go on.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct StudioArgs {
    /// Videos, folders of images, or folders of videos
    #[arg(value_name = "VIDEO|FOLDER")]
    videos: Vec<PathBuf>,

    /// Address to listen on. With another address, other machines can open the page with the token,
    /// unencrypted
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    listen: IpAddr,

    #[command(flatten)]
    page: PageArgs,

    /// Project file, for a single video [default: beside the video: clip.patchlock.json for
    /// clip.mp4]
    #[arg(long, value_name = "FILE", conflicts_with = "projects")]
    project: Option<PathBuf>,

    /// Folder for the projects of all videos, instead of beside them; created if missing
    #[arg(long, value_name = "DIR")]
    projects: Option<PathBuf>,

    /// Open the camera page
    #[arg(long)]
    camera: bool,

    /// Folder for uploaded videos and camera recordings, with their projects; created if missing
    #[arg(long, value_name = "DIR", default_value = "patchlock-uploads")]
    uploads: PathBuf,

    /// Largest upload in MB
    #[arg(long, value_name = "1..", default_value = "4096", value_parser = positive::<u64>())]
    max_upload: u64,

    #[command(flatten)]
    settings: SettingsArgs,

    /// Number of threads [default: one per core]; it does not change the boxes
    #[arg(long, value_name = THREADS_SHOWN, value_parser = threads())]
    threads: Option<usize>,

    #[command(flatten)]
    limits: LimitArgs,
}

impl StudioArgs {
    fn projects(&self) -> ProjectLocation {
        match (&self.project, &self.projects) {
            (Some(file), _) => ProjectLocation::File(file.clone()),
            (None, Some(folder)) => ProjectLocation::Folder(folder.clone()),
            (None, None) => ProjectLocation::Beside,
        }
    }
}

/// Serves the page until Ctrl-C. The helper, if there is one, decodes the videos.
pub fn run(args: &StudioArgs, helper: Option<Helper>) -> Result<()> {
    if let Some(missing) = args.videos.iter().find(|video| !video.exists()) {
        let message = format!("there is no file or folder {}", missing.display());
        return Err(usage(message).hint("name a video or a folder of images").into());
    }
    let videos: Vec<PathBuf> = args.videos.iter().flat_map(|path| clips(path)).collect();
    if args.project.is_some() && videos.len() != 1 {
        let message = format!("--project is for one video; there are {}", videos.len());
        return Err(usage(message).hint("--projects DIR is for those of all videos").into());
    }
    let config = args.settings.resolve(None)?;
    let options = Options {
        videos,
        projects: args.projects(),
        config,
        threads: args.threads,
        address: SocketAddr::new(args.listen, args.page.port),
        hosts: args.page.hosts(),
        // There is one studio in a process.
        limits: Limits {
            helper: helper.map(|it| &*Box::leak(Box::new(it))),
            ..args.limits.limits()
        },
        timeouts: Timeouts::default(),
        strangers: server::STRANGERS,
        uploads: args.uploads.clone(),
        upload_bytes: args.max_upload.saturating_mul(1 << 20),
        camera: args.camera,
        tokens: tokens(),
    };
    interrupt::listen()?;
    let server = Server::open(&options).map_err(failure)?;
    if !args.listen.is_loopback() {
        say(&format!(
            "warning: with --listen {} others on the network can reach this page, unencrypted: give \
             the address only to those who may change the annotations",
            args.listen
        ));
    }
    let address = server.address();
    print(&format!("{address}\n"))?;
    browser::say_tunnel(server.port());
    if let (false, Some((_, secret))) = (options.hosts.allowed.is_empty(), address.split_once('#'))
    {
        say(&format!("note: at another host, too, the address of the page ends with #{secret}"));
    }
    say("Ctrl-C ends the program.");
    if !args.page.no_open {
        browser::show(server.address_once());
    }
    for file in server.run(interrupt::requested).map_err(failure)? {
        say(&format!(
            "note: {} was written at the end: its last changes could not be written before",
            file.display()
        ));
    }
    Ok(())
}

/// The clips of a path: the videos of a folder that has no images, or else the path itself.
fn clips(path: &Path) -> Vec<PathBuf> {
    let has_images = || files::images(path).is_ok_and(|images| !images.is_empty());
    if !path.is_dir() || has_images() {
        return vec![path.to_path_buf()];
    }
    let is_video = |file: &PathBuf| VIDEOS.iter().any(|ending| files::ends_with(file, ending));
    let mut clips = files::entries(path).unwrap_or_default();
    clips.retain(|file| is_video(file) && file.is_file());
    // What is wrong with a folder of neither is said when it is opened.
    if clips.is_empty() { vec![path.to_path_buf()] } else { clips }
}

/// The folder for tokens, if the user has a folder for such files.
fn tokens() -> Option<PathBuf> {
    let folders = etcetera::choose_base_strategy().ok()?;
    let state = folders.state_dir().unwrap_or_else(|| folders.data_dir());
    Some(state.join("patchlock").join("studio"))
}

fn failure(error: server::Error) -> Failure {
    match error {
        server::Error::Listen { .. } => {
            failed(error.to_string()).hint("choose another --port, or none for a free one")
        }
        server::Error::Clip(error) => {
            let failure = failed(advice::project_message(&error));
            match &*error {
                project::Error::Track(patchlock_track::Error::Write { .. }) => {
                    failure.hint("--projects DIR keeps the projects in another folder")
                }
                error => advice::project_hint(error).into_iter().fold(failure, Failure::hint),
            }
        }
        server::Error::Folder { .. } => failed(error.to_string()).hint("choose another --projects"),
        server::Error::Unsaved(_) => failed(error.to_string()).hint(
            "free space on the disk, or allow writing to the folder, before you work on; the files have \
             all changes before those",
        ),
        server::Error::Start(_) => failed(error.to_string()),
    }
}
