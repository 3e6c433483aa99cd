//! Messages of TraX, a line each: `@@TRAX:name argument "argument with blanks" key=value`.

/// What begins every message; other lines are the tracker's own chatter.
const PREFIX: &str = "@@TRAX:";
/// The longest name of a named argument.
const LONGEST_KEY: usize = 64;

/// One message.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Message {
    /// Its name, such as `state`.
    pub name: String,
    /// The arguments without a name.
    pub arguments: Vec<String>,
    /// The others.
    pub named: Vec<(String, String)>,
}

impl Message {
    /// `None` for a line that is no message.
    ///
    /// # Errors
    /// What is wrong with a line that begins as one.
    pub fn parse(line: &str) -> Option<Result<Self, String>> {
        let rest = line.strip_prefix(PREFIX)?;
        Some(words(rest).and_then(|words| {
            let mut words = words.into_iter();
            let mut message = Self { name: words.next().unwrap_or_default(), ..Self::default() };
            if message.name.is_empty() {
                return Err("a message without a name".to_string());
            }
            for word in words {
                match named(&word) {
                    Some((key, value)) => message.named.push((key.to_string(), value.to_string())),
                    None => message.arguments.push(word),
                }
            }
            Ok(message)
        }))
    }

    /// The value of a named argument.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.named.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str())
    }
}

/// The line of a message with these arguments, with its end.
pub fn line(name: &str, arguments: &[&str]) -> String {
    let mut line = format!("{PREFIX}{name}");
    for argument in arguments {
        let escaped = argument.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
        line += &format!(" \"{escaped}\"");
    }
    line + "\n"
}

fn named(word: &str) -> Option<(&str, &str)> {
    let (key, value) = word.split_once('=')?;
    let is_key = |c: char| c.is_ascii_alphanumeric() || c == '.' || c == '_';
    (!key.is_empty() && key.len() <= LONGEST_KEY && key.chars().all(is_key)).then_some((key, value))
}

/// Splits at blanks that are not inside quotes, and resolves the escapes of quotes.
fn words(text: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quoted = false;
    let mut chars = text.trim_end().chars();
    while let Some(c) = chars.next() {
        match c {
            '"' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            '\\' => {
                let escaped = chars.next().ok_or("a backslash at the end")?;
                word.get_or_insert_default().push(if escaped == 'n' { '\n' } else { escaped });
            }
            c if c.is_whitespace() && !quoted => words.extend(word.take()),
            c => word.get_or_insert_default().push(c),
        }
    }
    if quoted {
        return Err("a quote that is not closed".to_string());
    }
    words.extend(word);
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Message {
        Message::parse(line).expect("a message").expect("a good one")
    }

    #[test]
    fn messages_are_read() {
        let hello =
            parsed("@@TRAX:hello \"trax.image=path;\" trax.version=3 \"trax.name=my tracker\"");
        assert_eq!((hello.name.as_str(), hello.arguments.len()), ("hello", 0));
        assert_eq!(
            (hello.get("trax.version"), hello.get("trax.name")),
            (Some("3"), Some("my tracker"))
        );
        let state = parsed("@@TRAX:state \"1,2,3,4\" confidence=0.5\r");
        assert_eq!((state.arguments, state.named.len()), (vec!["1,2,3,4".to_string()], 1));
        assert_eq!(Message::parse("loading weights"), None);
        for bad in ["@@TRAX:", "@@TRAX:state \"1,2", "@@TRAX:state \\"] {
            assert!(Message::parse(bad).is_some_and(|m| m.is_err()), "{bad}");
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let odd = "file:///a b/\"c\"\\d\ne=f";
        let message = parsed(&line("frame", &[odd, "1,2,3,4"]));
        assert_eq!(message.arguments, [odd, "1,2,3,4"]);
    }
}
