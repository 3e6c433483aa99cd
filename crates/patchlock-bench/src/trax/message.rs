//! Messages of TraX, one per line: `@@TRAX:name argument "argument with spaces" key=value`.

use std::fmt;

/// The start of every message; other lines are not part of the protocol.
const PREFIX: &str = "@@TRAX:";
/// Longest key of a named argument.
const LONGEST_KEY: usize = 64;

/// One message.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Message {
    /// Name of the message, such as `state`.
    pub name: String,
    /// The positional arguments.
    pub arguments: Vec<String>,
    /// The named arguments.
    pub named: Vec<(String, String)>,
}

impl Message {
    /// A message with positional arguments.
    pub fn new(name: &str, arguments: &[&str]) -> Self {
        let arguments = arguments.iter().map(|&argument| argument.to_string()).collect();
        Self { name: name.to_string(), arguments, named: Vec::new() }
    }

    /// Adds a named argument. A key has at most 64 letters, digits, `.` and `_`.
    #[must_use]
    pub fn with(mut self, key: &str, value: impl fmt::Display) -> Self {
        self.named.push((key.to_string(), value.to_string()));
        self
    }

    /// Parses a line; `None` if it is not a message.
    ///
    /// # Errors
    /// What is wrong with a line that starts like a message.
    pub fn parse(line: &str) -> Option<Result<Self, String>> {
        let rest = line.strip_prefix(PREFIX)?;
        Some(words(rest).and_then(|words| {
            let mut words = words.into_iter();
            let name = words.next().unwrap_or_default().to_ascii_lowercase();
            if name.is_empty() {
                return Err("a message without a name".to_string());
            }
            if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-') {
                let shown: String = name.chars().take(24).collect();
                return Err(format!("{shown:?} is not the name of a message, such as frame"));
            }
            // Old trackers send status instead of state.
            let name = if name == "status" { "state".to_string() } else { name };
            let mut message = Self { name, ..Self::default() };
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

/// Writes the message as a line, including the line end.
impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{PREFIX}{}", self.name)?;
        for argument in &self.arguments {
            write!(f, " \"{}\"", escaped(argument))?;
        }
        for (key, value) in &self.named {
            write!(f, " \"{key}={}\"", escaped(value))?;
        }
        writeln!(f)
    }
}

fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

fn named(word: &str) -> Option<(&str, &str)> {
    let (key, value) = word.split_once('=')?;
    let is_key = |c: char| c.is_ascii_alphanumeric() || c == '.' || c == '_';
    (!key.is_empty() && key.len() <= LONGEST_KEY && key.chars().all(is_key)).then_some((key, value))
}

/// Splits at whitespace outside quotes and resolves escapes.
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
        return Err("a quote is not closed".to_string());
    }
    words.extend(word);
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Message {
        Message::parse(line).expect("a message").expect("a valid one")
    }

    #[test]
    fn messages_are_parsed() {
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
        for bad in
            ["@@TRAX:", "@@TRAX:state \"1,2", "@@TRAX:state \\", "@@TRAX:a\\nb", "@@TRAX:a\" \"b"]
        {
            assert!(Message::parse(bad).is_some_and(|m| m.is_err()), "{bad}");
        }
    }

    #[test]
    fn names_are_case_insensitive() {
        assert_eq!(parsed("@@TRAX:QUIT").name, "quit");
        assert_eq!(parsed("@@TRAX:status 1,2,3,4").name, "state");
    }

    #[test]
    fn messages_survive_a_round_trip() {
        let awkward = "file:///a b/\"c\"\\d\ne=f";
        let message = Message::new("frame", &[awkward, "1,2,3,4"])
            .with("trax.reason", "a \"b\"\\ = c\nd")
            .with("confidence", 0.25)
            .with("empty", "");
        let line = message.to_string();
        assert_eq!(line.matches('\n').count(), 1, "{line}");
        assert_eq!(parsed(&line), message);
    }
}
