//! What differs by method, made from a list of them.

/// Makes the types that have a variant for each method. A row has the method's name, its folder, and
/// the folder's settings, view, saved form and tracker; where there is one, also the group of
/// settings that it shares with methods above it.
macro_rules! methods {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident = $folder:ident::{$config:ident, $view:ident, $saved:ident, $target:ident}
            $(, $shared:ident)?;
    )+) => {
        /// The methods of tracking, with their settings.
        #[derive(Debug, Clone, PartialEq, serde::Serialize)]
        #[serde(rename_all = "lowercase")]
        #[expect(clippy::large_enum_variant, reason = "a tracker has one")]
        pub enum Method {
            $($(#[doc = $doc])+ $name(crate::$folder::$config),)+
        }

        impl Method {
            /// The names of all methods.
            pub const NAMES: [&'static str; [$(stringify!($name)),+].len()] =
                [$(crate::$folder::$config::NAME),+];

            /// The rows of all groups.
            pub(super) const GROUPS: &'static [&'static [Parameter]] =
                &[&[SEED], $(crate::$folder::$config::ROWS, $($shared::ROWS,)?)+];

            /// Its settings.
            pub(crate) fn settings(&self) -> &dyn MethodConfig {
                match self {
                    $(Self::$name(settings) => settings,)+
                }
            }

            /// Its settings, to change them.
            pub(super) fn settings_mut(&mut self) -> &mut dyn MethodConfig {
                match self {
                    $(Self::$name(settings) => settings,)+
                }
            }

            /// As [`TargetTracker::begin`](crate::target_tracker::TargetTracker::begin).
            pub(crate) fn begin(
                &self,
                start: Start<'_>,
                scratch: &mut Scratch,
            ) -> Result<(Box<dyn DynTracker>, Estimate), Error> {
                match self {
                    $(Self::$name(settings) => {
                        dyn_tracker::begin::<crate::$folder::$target>(start, settings, scratch)
                    })+
                }
            }

            /// As [`TargetTracker::restore`](crate::target_tracker::TargetTracker::restore).
            pub(crate) fn restore(
                &self,
                saved: SavedTarget,
                network: Option<&Network>,
            ) -> Result<Box<dyn DynTracker>, Error> {
                match (self, saved) {
                    $((Self::$name(settings), SavedTarget::$name(saved)) => {
                        dyn_tracker::restore::<crate::$folder::$target>(saved, settings, network)
                    })+
                    (method, _) => Err(error::snapshot(format!(
                        "its target has another method than its configuration, which says {}",
                        method.name()
                    ))),
                }
            }
        }

        /// Named settings to begin with. The default is [`Preset::Robust`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Preset {
            $($(#[doc = $doc])+ $name,)+
        }

        impl Preset {
            /// All presets, the default first.
            pub const ALL: [Self; Method::NAMES.len()] = [$(Self::$name),+];

            /// The method and its settings.
            pub(super) fn method(self) -> Method {
                match self {
                    $(Self::$name => Method::$name(Default::default()),)+
                }
            }
        }

        /// The intermediate results of one frame, in the terms of the method that tracked it.
        #[derive(Debug)]
        #[non_exhaustive]
        pub enum FrameView<'a> {
            $($(#[doc = $doc])+ $name(crate::$folder::$view<'a>),)+
            /// A committee, after the views of its members.
            Committee(CommitteeView<'a>),
        }

        /// A target between two frames, as a snapshot holds it.
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "lowercase")]
        #[expect(clippy::large_enum_variant, reason = "all targets of a tracker are alike")]
        pub(crate) enum SavedTarget {
            $($name(crate::$folder::$saved),)+
            Committee(Vec<SavedTarget>),
        }

        $(
            impl From<crate::$folder::$config> for TrackerConfig {
                fn from(settings: crate::$folder::$config) -> Self {
                    Self { seed: 0, method: Method::$name(settings), network: None }
                }
            }

            impl<'a> From<crate::$folder::$view<'a>> for FrameView<'a> {
                fn from(view: crate::$folder::$view<'a>) -> Self {
                    Self::$name(view)
                }
            }

            impl From<crate::$folder::$saved> for SavedTarget {
                fn from(saved: crate::$folder::$saved) -> Self {
                    Self::$name(saved)
                }
            }
        )+
    };
}

pub(super) use methods;
