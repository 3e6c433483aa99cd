//! The token in a file of the user's own, so that a page that is open goes on when the program was
//! ended, or killed, and is started again.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use sha2::{Digest as _, Sha256};
use tempfile::NamedTempFile;

use super::access::random_hex;

/// Random bytes of a token.
const BYTES: usize = 32;
/// How long a token is kept after the start of the program.
const KEPT: Duration = Duration::from_secs(7 * 24 * 3600);
/// The end of the names of files with tokens.
const ENDING: &str = "token";

/// A new token.
pub fn draw() -> Result<String, String> {
    random_hex::<BYTES>()
}

/// The file for the token of a server of this description.
pub fn file(folder: &Path, description: &str) -> PathBuf {
    let hash = Sha256::digest(description.as_bytes());
    let name: String = hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    folder.join(name).with_extension(ENDING)
}

/// The token that a server had in the last days, or a new one, which is kept in this file.
pub fn kept(file: &Path) -> Result<String, String> {
    let folder = file.parent().unwrap_or(Path::new("."));
    let token = read(file).map_or_else(draw, Ok)?;
    // Without the file the token holds all the same, but for this run only.
    let _ = write(folder, file, &token);
    remove_old(folder);
    Ok(token)
}

/// The token in a file that nobody else can read, and that is not too old.
fn read(file: &Path) -> Option<String> {
    let about = fs::symlink_metadata(file).ok()?;
    let is_ours = about.is_file() && is_private(&about) && !is_old(&about);
    let token = is_ours.then(|| fs::read_to_string(file).ok())??;
    let is_token = token.len() == 2 * BYTES && token.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_token.then_some(token)
}

#[cfg(unix)]
fn is_private(about: &fs::Metadata) -> bool {
    use std::os::unix::fs::PermissionsExt as _;
    about.permissions().mode() & 0o077 == 0
}

/// The folder is below that of the user, which others cannot read.
#[cfg(not(unix))]
fn is_private(_: &fs::Metadata) -> bool {
    true
}

fn is_old(about: &fs::Metadata) -> bool {
    // A time in the future is no old one.
    about.modified().is_ok_and(|at| at.elapsed().is_ok_and(|age| age > KEPT))
}

/// Writes a file whole or not at all; nobody else can read it.
fn write(folder: &Path, file: &Path, token: &str) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let mut new = NamedTempFile::new_in(folder)?;
    new.write_all(token.as_bytes())?;
    new.persist(file)?;
    Ok(())
}

/// Removes the tokens of servers that were not started for long.
fn remove_old(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_token = entry.path().extension().is_some_and(|end| end == ENDING);
        if is_token && entry.metadata().is_ok_and(|about| is_old(&about)) {
            // The next start tries again.
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use super::*;

    #[test]
    fn a_token_is_kept_for_days_where_nobody_else_reads_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path().join("state");
        let kept = |name| super::kept(&file(&folder, name));
        let token = kept("one").expect("draws");
        assert_eq!(kept("one").as_ref(), Ok(&token));
        assert_ne!(kept("two").as_ref(), Ok(&token));
        let path = file(&folder, "one");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            let mode = |path| fs::metadata(path).expect("is there").permissions().mode() & 0o777;
            assert_eq!(mode(&path), 0o600);
            fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).expect("sets");
            assert_ne!(kept("one").as_ref(), Ok(&token), "others may know it");
            assert_eq!(mode(&path), 0o600);
        }
        let token = kept("one").expect("is kept");
        let opened = fs::File::options().write(true).open(&path).expect("opens");
        opened.set_modified(SystemTime::now() - KEPT * 2).expect("sets");
        assert_ne!(kept("one").as_ref(), Ok(&token), "it is old");
        opened.set_modified(SystemTime::now() - KEPT * 2).expect("sets");
        fs::write(&path, "no token").expect("writes");
        assert_eq!(kept("one").expect("draws").len(), 2 * BYTES);
        let old = fs::File::options().write(true).open(&path).expect("opens");
        old.set_modified(SystemTime::now() - KEPT * 2).expect("sets");
        kept("two").expect("is kept");
        assert!(!path.exists(), "nobody uses it any more");
    }
}
