//! Writes the seeds of all surfaces, or of those that are named: `seeds DIR [SURFACE...]`. Each
//! surface gets a folder.

use std::path::Path;
use std::process::ExitCode;
use std::{env, fs};

use patchlock_fuzz::{SURFACES, seeds::seeds};

fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    let Some(folder) = arguments.next() else {
        eprintln!("seeds DIR [SURFACE...]: name a folder for the seeds");
        return ExitCode::from(2);
    };
    let mut names: Vec<String> = arguments.collect();
    if names.is_empty() {
        names = SURFACES.iter().map(|(name, _)| (*name).to_owned()).collect();
    }
    for name in names {
        let all = seeds(&name);
        if all.is_empty() {
            let known: Vec<_> = SURFACES.iter().map(|(name, _)| *name).collect();
            eprintln!("there is no surface {name}; the surfaces are {}", known.join(", "));
            return ExitCode::from(2);
        }
        let folder = Path::new(&folder).join(&name);
        fs::create_dir_all(&folder).expect("the folder can be made");
        for (k, seed) in all.iter().enumerate() {
            fs::write(folder.join(format!("seed-{k:02}")), seed).expect("a seed can be written");
        }
    }
    ExitCode::SUCCESS
}
