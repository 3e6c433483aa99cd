//! Whole numbers as values of options.

/// Reads a whole number from `least` to `most`; what is none learns which ones are allowed.
pub fn whole<T: TryFrom<u64>>(
    least: u64,
    most: u64,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse().ok().filter(|number| (least..=most).contains(number));
        number.and_then(|number| T::try_from(number).ok()).ok_or_else(|| match most {
            u64::MAX => format!("it must be a whole number, {least} or more"),
            _ => format!("it must be a whole number, {least} to {most}"),
        })
    }
}

/// The seeds that there are.
pub fn seed() -> impl Fn(&str) -> Result<u64, String> + Clone + Send + Sync + 'static {
    // Every file format keeps whole numbers up to it.
    whole(0, (1 << 53) - 1)
}

/// Numbers of threads: more than the largest no machine has.
pub fn threads<T: TryFrom<u64>>() -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync {
    whole(1, crate::engine::MOST_THREADS as u64)
}
