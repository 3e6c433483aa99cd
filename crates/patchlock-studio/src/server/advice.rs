//! Words hints for the page. The user of the page has the program's window beside it, but gives no
//! options. Where nothing is worded here, the hint is the error's own advice.

use crate::project;

/// The hint for an error of a video.
pub fn media(error: &patchlock_media::Error) -> Option<String> {
    use patchlock_media::Error;
    let hint = match error {
        Error::TooLarge { .. } | Error::TooManyPixels { .. } => {
            "scale the video down, or start the studio with a higher limit of pixels"
        }
        Error::Missing { .. } => "check that the file has not been moved or removed",
        Error::Endless(_) | Error::NoVideo(_) | Error::Playlist(_) => "open a file with a video",
        // Without the file, the later frames would have other numbers than in the project.
        Error::Image { .. } => "replace that file",
        _ => return error.advice(),
    };
    Some(hint.to_string())
}

/// The hint for an error of an export.
pub fn track(error: &patchlock_track::Error) -> Option<String> {
    use patchlock_track::Error;
    match error {
        Error::Media(error) => media(error),
        Error::Export(_) => Some("docs/many-targets.md says what each format holds".to_string()),
        _ => error.advice(),
    }
}

/// The hint for an error of a project.
pub fn project(error: &project::Error) -> Option<String> {
    match error {
        project::Error::OtherVideo { .. } => {
            Some("start the studio with another project file".to_string())
        }
        project::Error::Track(patchlock_track::Error::Write { .. }) => Some(
            "free space on the disk, or start the studio with another folder for the projects"
                .to_string(),
        ),
        project::Error::Track(error) => track(error),
        _ => error.advice(),
    }
}
