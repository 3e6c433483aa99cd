//! Published files that were tried with this program.

/// A published file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct KnownModel {
    /// The name of the network.
    pub name: &'static str,
    /// The name of the file.
    pub file: &'static str,
    /// The SHA-256 of the file, in hexadecimal.
    pub sha256: &'static str,
    /// Who publishes it, and where in the repository it is.
    pub origin: &'static str,
    /// The licence that its publisher states.
    pub licence: &'static str,
    /// What it was trained on, and what that means for its use.
    pub training: &'static str,
}

const NANOTRACK_TRAINING: &str = "trained on GOT-10k, ImageNet VID and DET, YouTube-BB, COCO and LaSOT, on a MobileNetV3 \
     pretrained on ImageNet. Several of these are given out for research only, and what that means \
     for the weights is unsettled: decide for yourself whether you may use it";

const VITTRACK_TRAINING: &str =
    "its publisher does not say what it was trained on: decide for yourself whether you may use it";

const fn nanotrack([name, file, sha256, origin]: [&'static str; 4]) -> KnownModel {
    let (licence, training) = ("Apache-2.0", NANOTRACK_TRAINING);
    KnownModel { name, file, sha256, origin, licence, training }
}

const fn patchnet([file, sha256]: [&'static str; 2]) -> KnownModel {
    KnownModel {
        name: "PatchNet",
        file,
        sha256,
        origin: "part of Patchlock, crates/patchlock/models",
        licence: "MIT OR Apache-2.0",
        training: "trained by training/ on free pictures, some under GPL or CC-BY-SA: what that means for the \
             weights is unsettled, see training/MODEL_CARD.md",
    }
}

/// All of them.
pub const KNOWN_MODELS: &[KnownModel] = &[
    patchnet([
        "patchnet_backbone.onnx",
        "31698f0b4bf6fb02956aeb07b0a62b9ff32c1aa27a2f557f6ddc9ad08da3a143",
    ]),
    patchnet([
        "patchnet_head.onnx",
        "db4e3ca75a57c8bff82c593615b8c7b1fca521df786a804f883b837d40f75665",
    ]),
    nanotrack([
        "NanoTrack v3",
        "nanotrack_backbone.onnx",
        "50be1320abf9384fd3479ea829f95e244cf3f3838190c5ab60c750fb8c1ce828",
        "github.com/HonglinChu/SiamTrackers, NanoTrack/models/nanotrackv3",
    ]),
    nanotrack([
        "NanoTrack v3",
        "nanotrack_head.onnx",
        "75357903be3f4817c965af16cb5a11fd32b1467f597a408405a98635ac63f61d",
        "github.com/HonglinChu/SiamTrackers, NanoTrack/models/nanotrackv3",
    ]),
    nanotrack([
        "NanoTrack v2",
        "nanotrack_backbone_sim.onnx",
        "530bdd0cd00f19afab79a863e71ba71e3312395a5dc9151af675082bdaaa2fc4",
        "github.com/HonglinChu/SiamTrackers, NanoTrack/models/nanotrackv2",
    ]),
    nanotrack([
        "NanoTrack v2",
        "nanotrack_head_sim.onnx",
        "0d8c0637be849f092cc7236cae02e55c8b9455ebe37ba50601d6115db4247cd9",
        "github.com/HonglinChu/SiamTrackers, NanoTrack/models/nanotrackv2",
    ]),
    KnownModel {
        name: "VitTrack",
        file: "vitTracker.onnx",
        sha256: "ac1418b43519a5118dba03e1db181b5ca83f3a61b76582841ce8a725d8bfa249",
        origin: "github.com/opencv/opencv_zoo at bae1b126, models/object_tracking_vittrack",
        licence: "Apache-2.0",
        training: VITTRACK_TRAINING,
    },
];

impl KnownModel {
    /// The file with this SHA-256, in hexadecimal.
    pub fn with_hash(sha256: &str) -> Option<&'static Self> {
        KNOWN_MODELS.iter().find(|model| model.sha256 == sha256)
    }
}
