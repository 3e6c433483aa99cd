//! This program in a second process, in which the system keeps it to one file that it decodes.

use std::ffi::OsString;

use patchlock_media::Helper;

/// The only argument of that process. It is no command for people.
const WORD: &str = "decode-for-another-patchlock";

/// How this program is started again; `None` where the system has no sandbox for it.
pub fn itself() -> Option<Helper> {
    // The file of the program may have been replaced since it was started; this leads to the old one.
    cfg!(target_os = "linux").then(|| Helper::new("/proc/self/exe", [WORD]))
}

/// Whether this command line starts it.
pub fn is_wanted(args: &[OsString]) -> bool {
    cfg!(target_os = "linux") && args.len() == 2 && args[1] == WORD
}

/// Decodes for the process that has started this one, and returns the exit code.
pub fn run() -> u8 {
    #[cfg(target_os = "linux")]
    {
        patchlock_media::silence_decoders();
        u8::from(patchlock_media::serve().is_err())
    }
    #[cfg(not(target_os = "linux"))]
    {
        2
    }
}
