//! Recognises files that name other files instead of holding a video.

/// How such files begin: playlists of HLS, of DASH and other XML, of ffmpeg, of players, and
/// descriptions of streams.
const BEGINNINGS: [&str; 9] =
    ["#extm3u", "<?xml", "<mpd", "<smil", "<asx", "ffconcat", "[playlist]", "[reference]", "v=0"];

/// How many bytes at the beginning of a file [`is_playlist`] needs.
pub const HEAD: usize = 64;

/// Whether a file with this beginning names others.
pub fn is_playlist(head: &[u8]) -> bool {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let starts = |with: &str| {
        text.get(..with.len()).is_some_and(|start| start.eq_ignore_ascii_case(with.as_bytes()))
    };
    BEGINNINGS.into_iter().any(starts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_told_from_videos() {
        let lists = ["#EXTM3U\n#EXT", "\u{feff}\n <?xml version", "<MPD", "ffconcat version 1.0"];
        for list in lists {
            assert!(is_playlist(list.as_bytes()), "{list}");
        }
        for video in [&b"\x1a\x45\xdf\xa3"[..], b"RIFF\x24\0\0\0AVI LIST", b"OggS", b"GIF89a", b""]
        {
            assert!(!is_playlist(video), "{video:?}");
        }
    }
}
