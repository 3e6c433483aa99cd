//! Every surface with its seeds, with random changes of them, and with inputs that once failed.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use fastrand::Rng;
use patchlock_fuzz::mutate::mutated;
use patchlock_fuzz::seeds::seeds;
use patchlock_fuzz::{SURFACES, Surface, UPDATES};
use patchlock_testdata::slow;
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// The tests run one after another: each counts the memory of the process.
static ALONE: Mutex<()> = Mutex::new(());

/// The most memory that an input may take, in bytes.
const MEMORY: usize = 1 << 30;
/// The most processor time for one input, and ten times that by the clock: machines that test are
/// busy.
const PATIENCE: Duration = Duration::from_secs(10);
/// Changed inputs of each surface, and the time after which no more are tried.
const INPUTS: usize = 3000;
const TIME: Duration = Duration::from_secs(3);
const SHORT: Duration = Duration::from_millis(300);
/// Inputs that are tried of every surface, however slow the machine is.
const LEAST: usize = 20;

fn alone() -> MutexGuard<'static, ()> {
    patchlock_media::silence_decoders();
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The processor time that this process has had, where the system tells it.
fn processor_time() -> Option<Duration> {
    let about = fs::read_to_string("/proc/self/stat").ok()?;
    // After the name come the state and numbers; the 12th and 13th are ticks of ten milliseconds.
    let mut fields = about.rsplit_once(')')?.1.split_whitespace().skip(11);
    let ticks: u64 = fields.next()?.parse::<u64>().ok()? + fields.next()?.parse::<u64>().ok()?;
    Some(Duration::from_millis(10 * ticks))
}

/// Runs a surface, within limits. An input that fails is named, and kept if there is a folder for
/// it.
fn run(surface: Surface, input: &[u8], name: &str) {
    ALLOCATOR.reset_peak_usage();
    let (before, begun, used) = (ALLOCATOR.current_usage(), Instant::now(), processor_time());
    let outcome = std::panic::catch_unwind(|| surface(input));
    let (time, memory) = (begun.elapsed(), ALLOCATOR.peak_usage().saturating_sub(before));
    // The other tests of this process run at the same time.
    let own = processor_time()
        .zip(used)
        .map_or(time, |(now, before)| now.saturating_sub(before).min(time));
    if outcome.is_ok() && own < PATIENCE && time < 10 * PATIENCE && memory < MEMORY {
        return;
    }
    let kept = std::env::var_os("PATCHLOCK_FUZZ_KEEP").map(|folder| {
        let file = PathBuf::from(folder).join(name.replace([' ', '/'], "-"));
        fs::write(&file, input).expect("the folder in PATCHLOCK_FUZZ_KEEP can be written");
        file
    });
    panic!(
        "{name} failed after {time:?}, {own:?} of a processor, with {memory} bytes; the input is in {kept:?}"
    );
}

/// Tries the seeds, and then changes of them.
fn try_changes(name: &str) {
    let _alone = alone();
    let surface = SURFACES.iter().find(|(known, _)| *known == name).expect("is a surface").1;
    let seeds = seeds(name);
    assert!(!seeds.is_empty(), "{name} has no seeds");
    for (k, seed) in seeds.iter().enumerate() {
        run(surface, seed, &format!("{name} seed {k}"));
    }
    let scale = std::env::var("PATCHLOCK_FUZZ_SCALE").ok().and_then(|scale| scale.parse().ok());
    let scale: u32 = scale.unwrap_or(1);
    let (mut draws, begun) = (Rng::with_seed(u64::from(scale)), Instant::now());
    let mut tried = 0;
    let time = if slow(name, 3 * scale) { TIME * scale } else { SHORT };
    while tried < INPUTS * scale as usize && (tried < LEAST || begun.elapsed() < time) {
        let seed = &seeds[draws.usize(..seeds.len())];
        let other = &seeds[draws.usize(..seeds.len())];
        run(surface, &mutated(seed, other, &mut draws), &format!("{name} input {tried}"));
        tried += 1;
    }
    println!("{name}: {tried} inputs in {:?}", begun.elapsed());
    if name == "library" {
        println!("{} frames tracked", UPDATES.load(Relaxed));
    }
}

macro_rules! surfaces {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() {
            try_changes(stringify!($name));
        })*

        #[test]
        fn every_surface_has_a_test() {
            let tested = [$(stringify!($name)),*];
            assert!(SURFACES.iter().map(|(name, _)| *name).eq(tested));
        }
    };
}

surfaces! {
    mp4 h264 y4m images truth results boxes tracks imports settings snapshot_robust
    snapshot_paper snapshot_network snapshot_packed model trax project labels server library folder
}

/// Inputs that fuzzing found are small files in `fuzz/found/SURFACE`.
#[test]
fn what_was_found_is_mended() {
    let _alone = alone();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/found");
    for folder in fs::read_dir(&root).expect("the found inputs are in the repository").flatten() {
        let name = folder.file_name().to_string_lossy().into_owned();
        let known = SURFACES.iter().find(|(known, _)| *known == name);
        let (_, surface) = known.unwrap_or_else(|| panic!("{name} is not a surface"));
        for file in fs::read_dir(folder.path()).expect("is a folder").flatten() {
            let input = fs::read(file.path()).expect("can be read");
            run(*surface, &input, &format!("{name} {}", file.file_name().to_string_lossy()));
        }
    }
}
