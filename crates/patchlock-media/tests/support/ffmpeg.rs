//! Videos that ffmpeg makes for tests.

use std::process::Command;

/// Whether there is an ffmpeg; says what is skipped if there is none.
pub fn ffmpeg_is_there(what: &str) -> bool {
    let there = Command::new("ffmpeg").arg("-version").output().is_ok();
    if !there {
        println!("skipped {what}: ffmpeg is not on the PATH");
    }
    there
}

/// What ffmpeg writes to standard output with these arguments.
pub fn ffmpeg(args: &[&str]) -> Vec<u8> {
    let mut command = Command::new("ffmpeg");
    let result = command.args(["-v", "error", "-nostdin", "-y"]).args(args).output().unwrap();
    assert!(result.status.success(), "{args:?}: {}", String::from_utf8_lossy(&result.stderr));
    result.stdout
}
