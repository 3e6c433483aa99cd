//! Starts a program that decodes the file of a stranger so that it can do little else, where the
//! system can see to that.

use std::io;
use std::path::Path;
use std::process::{Child, Command};

/// Memory that a decoder needs for its code and for what does not follow the size of a frame.
const BASE: u64 = 2 << 30;
/// Memory for each pixel of a frame: some twenty frames of 16 bits that others refer to, and one for
/// each thread.
const PER_PIXEL: u64 = 100;

/// What a program may do.
#[cfg_attr(
    not(all(target_os = "linux", target_endian = "little")),
    allow(dead_code, reason = "only Linux keeps a program to all of it")
)]
pub struct SandboxPolicy<'a> {
    /// Files that it reads, and folders with all that is in them.
    pub reads: Vec<&'a Path>,
    /// Whether it is this program, which needs no libraries but those of the system.
    pub is_ours: bool,
    /// Folders in which it may do anything.
    pub changes: Vec<&'a Path>,
    /// The most pixels of a frame.
    pub pixels: usize,
}

/// Starts a program that may do no more than that. On Linux it reads only the file, programs and
/// libraries, changes only the folders, opens no connection, and has limited memory. Where the
/// kernel cannot see to one of these, the others hold; elsewhere, none does.
pub fn spawn(command: &mut Command, policy: &SandboxPolicy<'_>) -> io::Result<Child> {
    let child = confined::spawn(command, policy)?;
    let frames = PER_PIXEL.saturating_mul(policy.pixels as u64);
    confined::limit(&child, BASE.saturating_add(frames));
    Ok(child)
}

#[cfg(not(all(target_os = "linux", target_endian = "little")))]
mod confined {
    use super::{Child, Command, SandboxPolicy, io};

    pub fn spawn(command: &mut Command, _: &SandboxPolicy<'_>) -> io::Result<Child> {
        command.spawn()
    }

    pub fn limit(_: &Child, _: u64) {}
}

#[cfg(all(target_os = "linux", target_endian = "little"))]
mod confined {
    use std::ffi::OsStr;
    use std::path::PathBuf;
    use std::{env, thread};

    use landlock::{
        ABI, Access as _, AccessFs, AccessNet, RestrictionStatus, Ruleset, RulesetAttr as _,
        RulesetCreatedAttr as _, RulesetError, Scope, make_bitflags, path_beneath_rules,
    };
    use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit};
    use seccompiler::{BpfProgram, SeccompAction, SeccompFilter};

    use super::{Child, Command, Path, SandboxPolicy, io};

    /// Where programs and their libraries are.
    const PROGRAMS: [&str; 10] = [
        "/usr",
        "/bin",
        "/sbin",
        "/lib",
        "/lib32",
        "/lib64",
        "/opt",
        "/nix/store",
        "/gnu/store",
        "/home/linuxbrew/.linuxbrew",
    ];
    /// What libraries read when they are loaded.
    const LOADING: [&str; 7] = [
        "/etc/ld.so.cache",
        "/etc/ld.so.preload",
        "/etc/ssl/openssl.cnf",
        "/dev/urandom",
        "/proc/cpuinfo",
        "/proc/sys/crypto/fips_enabled",
        "/sys/devices/system",
    ];
    /// A program of these folders starts another one with more rights, which a confined one cannot.
    const SNAPS: &str = "/snap";
    /// The kernel's rules that are known. Older kernels have a part of them.
    const RULES: ABI = ABI::V6;
    /// What no decoder calls: ways to other machines and programs. `io_uring` would be a way around
    /// the others.
    const REFUSED: [libc::c_long; 18] = [
        libc::SYS_socket,
        libc::SYS_io_uring_setup,
        libc::SYS_ptrace,
        libc::SYS_process_vm_readv,
        libc::SYS_process_vm_writev,
        libc::SYS_pidfd_getfd,
        libc::SYS_bpf,
        libc::SYS_perf_event_open,
        libc::SYS_userfaultfd,
        libc::SYS_add_key,
        libc::SYS_request_key,
        libc::SYS_keyctl,
        libc::SYS_mount,
        libc::SYS_unshare,
        libc::SYS_setns,
        libc::SYS_kexec_load,
        libc::SYS_init_module,
        libc::SYS_finit_module,
    ];
    /// Marks the calls of x86-64 with short pointers, which lead to the same functions.
    const SHORT_POINTERS: libc::c_long = 0x4000_0000;

    pub fn spawn(command: &mut Command, policy: &SandboxPolicy<'_>) -> io::Result<Child> {
        let program = found(command.get_program());
        if program.as_ref().is_some_and(|program| program.starts_with(SNAPS)) {
            return command.spawn();
        }
        // The rules are those of a thread and of what it starts. This thread then ends.
        let start = || {
            let _ = keep_to_files(program.as_deref(), policy);
            let _ = refuse_calls();
            command.spawn()
        };
        thread::scope(|scope| {
            let started = thread::Builder::new().spawn_scoped(scope, start)?.join();
            started.unwrap_or_else(|_| Err(io::Error::other("the thread that starts it failed")))
        })
    }

    /// The program that a command starts.
    fn found(name: &OsStr) -> Option<PathBuf> {
        let name = Path::new(name);
        if name.components().count() > 1 {
            return Some(name.to_path_buf());
        }
        env::split_paths(&env::var_os("PATH")?)
            .map(|folder| folder.join(name))
            .find(|at| at.is_file())
    }

    /// Where the program and its libraries are. Nothing is known of where other programs of an
    /// unusual place have theirs.
    fn programs(program: Option<&Path>, is_ours: bool) -> Vec<PathBuf> {
        let whole = program.and_then(|program| program.canonicalize().ok());
        let is_there = |whole: &PathBuf| PROGRAMS.iter().any(|folder| whole.starts_with(folder));
        if !is_ours && !whole.as_ref().is_some_and(is_there) {
            return vec!["/".into()];
        }
        let named = ["LD_LIBRARY_PATH", "LD_PRELOAD"].map(env::var_os);
        let named = named.iter().flatten().flat_map(env::split_paths);
        let named = named.filter(|path| path.is_absolute());
        let own = program.filter(|_| is_ours).map(Path::to_path_buf);
        PROGRAMS.iter().map(PathBuf::from).chain(named).chain(own).collect()
    }

    /// Files that may be read and changed from now on by this thread and what it starts. Another
    /// program of an unusual place may read all, and still changes nothing and connects to nothing.
    pub(super) fn keep_to_files(
        program: Option<&Path>,
        policy: &SandboxPolicy<'_>,
    ) -> Result<RestrictionStatus, RulesetError> {
        let reading = AccessFs::from_read(RULES);
        let looking = make_bitflags!(AccessFs::{ReadFile | ReadDir});
        let null = make_bitflags!(AccessFs::{ReadFile | WriteFile});
        Ruleset::default()
            .handle_access(AccessFs::from_all(RULES))?
            .handle_access(AccessNet::from_all(RULES))?
            .scope(Scope::from_all(RULES))?
            .create()?
            .add_rules(path_beneath_rules(programs(program, policy.is_ours), reading))?
            .add_rules(path_beneath_rules(LOADING, looking))?
            .add_rules(path_beneath_rules(["/dev/null"], null))?
            .add_rules(path_beneath_rules(&policy.reads, looking))?
            .add_rules(path_beneath_rules(&policy.changes, AccessFs::from_all(RULES)))?
            .restrict_self()
    }

    /// Makes calls fail from now on for this thread and what it starts.
    fn refuse_calls() -> Result<(), Box<dyn std::error::Error>> {
        let numbers = REFUSED.iter().flat_map(|&call| match cfg!(target_arch = "x86_64") {
            true => vec![call, call | SHORT_POINTERS],
            false => vec![call],
        });
        // Numbers are 32 bits wide on some architectures.
        #[allow(clippy::useless_conversion)]
        let rules = numbers.map(|number| (i64::from(number), Vec::new())).collect();
        let refusal = SeccompAction::Errno(libc::EPERM as u32);
        let here = env::consts::ARCH.try_into()?;
        let filter = SeccompFilter::new(rules, SeccompAction::Allow, refusal, here)?;
        Ok(seccompiler::apply_filter(&BpfProgram::try_from(filter)?)?)
    }

    /// Limits the memory of a process that was started just now. It leaves no core, which would hold
    /// what it has read.
    pub fn limit(child: &Child, bytes: u64) {
        let process = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        for (resource, most) in [(Resource::Data, bytes), (Resource::Core, 0)] {
            // What the user has limited further stays so.
            let ours = getrlimit(resource);
            let most = |limit: Option<u64>| Some(limit.map_or(most, |limit| limit.min(most)));
            let limits = Rlimit { current: most(ours.current), maximum: most(ours.maximum) };
            // It may have ended.
            let _ = process.map(|process| prlimit(Some(process), resource, limits));
        }
    }
}

#[cfg(all(test, target_os = "linux", target_endian = "little"))]
pub mod tests {
    use std::fs;
    use std::net::{TcpListener, UdpSocket};
    use std::process::Stdio;

    use landlock::RulesetStatus;

    use super::*;

    fn of<'a>(file: &'a Path, changes: Vec<&'a Path>, pixels: usize) -> SandboxPolicy<'a> {
        SandboxPolicy { reads: vec![file], is_ours: false, changes, pixels }
    }

    /// Whether the kernel keeps all the rules for files.
    pub fn files_are_kept() -> bool {
        let nothing = of(Path::new("/dev/null"), Vec::new(), 1);
        let status = std::thread::spawn(move || confined::keep_to_files(None, &nothing)).join();
        let enforced = status.unwrap().unwrap().ruleset == RulesetStatus::FullyEnforced;
        if !enforced {
            println!("skipped: this kernel does not keep a program to its files");
        }
        enforced
    }

    /// What a shell script writes to its output if it may do no more than this.
    fn said(shell: &str, script: &str, policy: &SandboxPolicy<'_>) -> String {
        let mut command = Command::new(shell);
        command.args(["-c", script]).stdin(Stdio::null());
        let child = spawn(command.stdout(Stdio::piped()).stderr(Stdio::null()), policy).unwrap();
        String::from_utf8(child.wait_with_output().unwrap().stdout).unwrap()
    }

    #[test]
    fn a_decoder_reads_one_file_and_changes_one_folder() {
        if !files_are_kept() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("own")).unwrap();
        for name in ["video", "secret"] {
            fs::write(at(name), name).unwrap();
        }
        std::os::unix::fs::symlink(at("secret"), at("own/link")).unwrap();
        let (video, own) = (at("video"), at("own"));
        let policy = of(&video, vec![&own], 1);
        let here = folder.path().display();
        let script = format!(
            "cd {here}/own; cat ../video ../secret link; echo x > new; cat new; ls ..
             echo y > ../new; echo y >> ../video; rm ../secret; mv ../video .; echo z > link
             cat /proc/$PPID/environ /etc/passwd; kill -0 $PPID && echo may kill"
        );
        assert_eq!(said("sh", &script, &policy), "videox\n");
        assert_eq!(fs::read_to_string(at("video")).unwrap(), "video");
        assert_eq!(fs::read_to_string(at("secret")).unwrap(), "secret");
        assert!(!at("new").exists());
    }

    /// From a place of its own it may read what it needs, and not more than that.
    #[test]
    fn a_decoder_of_an_unusual_place_changes_nothing_either() {
        if !files_are_kept() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("library"), "library").unwrap();
        fs::copy("/bin/sh", at("shell")).unwrap();
        let video = at("video");
        let policy = of(&video, Vec::new(), 1);
        let script = format!("cd {}; cat library; echo x > library", folder.path().display());
        assert_eq!(said(at("shell").to_str().unwrap(), &script, &policy), "library");
        assert_eq!(fs::read_to_string(at("library")).unwrap(), "library");
    }

    #[test]
    fn a_decoder_connects_to_nothing() {
        if !Path::new("/bin/bash").exists() {
            return println!("skipped: there is no bash, which can connect");
        }
        let (tcp, udp) = (TcpListener::bind("127.0.0.1:0"), UdpSocket::bind("127.0.0.1:0"));
        let ports = [tcp.unwrap().local_addr().unwrap(), udp.unwrap().local_addr().unwrap()];
        let [tcp, udp] = ports.map(|address| address.port());
        let script = format!(
            "echo begins; (echo > /dev/tcp/127.0.0.1/{tcp}) && echo tcp
             (echo > /dev/udp/127.0.0.1/{udp}) && echo udp"
        );
        let policy = of(Path::new("/dev/null"), Vec::new(), 1);
        assert_eq!(said("/bin/bash", &script, &policy), "begins\n");
        let free = Command::new("/bin/bash").args(["-c", &script]).output().unwrap().stdout;
        assert!(String::from_utf8(free).unwrap().contains("udp"), "the script can connect");
    }

    #[test]
    fn a_decoder_has_memory_by_the_pixels_of_a_frame() {
        // It is started before it is limited.
        let script =
            "while [ $(ulimit -d) = unlimited ]; do sleep 0.01; done; ulimit -d; ulimit -c";
        let file = Path::new("/dev/null");
        let kept = |pixels| said("sh", script, &of(file, Vec::new(), pixels));
        assert_eq!(kept(10 << 20), format!("{}\n0\n", (2 << 20) + (1000 << 10)));
        assert_eq!(kept(20 << 20), format!("{}\n0\n", (2 << 20) + (2000 << 10)));
    }
}
