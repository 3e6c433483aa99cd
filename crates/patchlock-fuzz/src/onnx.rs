//! Changes of the fields of an ONNX file. A file is mostly weights, so changes of its bytes seldom
//! change its graph.

/// A field of a message of Protocol Buffers: its number and what it holds.
#[derive(Debug, Clone)]
struct Field {
    number: u64,
    content: Content,
}

#[derive(Debug, Clone)]
enum Content {
    Number(u64),
    /// Eight or four bytes.
    Fixed(Vec<u8>),
    Bytes(Vec<u8>),
    Message(Vec<Field>),
}

/// The messages of ONNX whose fields are changed.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Model,
    Graph,
    Node,
    Attribute,
    ValueInfo,
    Type,
    TensorType,
    Shape,
    Leaf,
}

impl Kind {
    /// The message in the field of this number, if there is one.
    fn within(self, number: u64) -> Option<Self> {
        Some(match (self, number) {
            (Self::Model, 7) => Self::Graph,
            (Self::Graph, 1) => Self::Node,
            (Self::Graph, 11..=13) => Self::ValueInfo,
            (Self::Node, 5) => Self::Attribute,
            (Self::ValueInfo, 2) => Self::Type,
            (Self::Type, 1) => Self::TensorType,
            (Self::TensorType, 2) => Self::Shape,
            // A set of operators, a tensor, a dimension.
            (Self::Model, 8) | (Self::Graph | Self::Attribute, 5) | (Self::Shape, 1) => Self::Leaf,
            _ => return None,
        })
    }
}

/// Numbers that take the place of another.
const NUMBERS: [u64; 16] =
    [0, 1, 2, 3, 5, 7, 8, 16, 63, 255, 4097, 1 << 24, 1 << 31, 1 << 40, i64::MAX as u64, u64::MAX];

/// Words that take the place of another.
const WORDS: [&str; 12] = [
    "", "input", "input1", "output", "Relu", "Concat", "Reshape", "MatMul", "Gemm", "axis",
    "Slice", "Split",
];

/// The file after changes of its fields: each is six bytes, the field, what happens to it, and from
/// which other field or number.
pub fn edited(file: &[u8], edits: &[u8]) -> Vec<u8> {
    let mut fields = read(file, Kind::Model).unwrap_or_default();
    for &[low, high, action, other, more, value] in edits.as_chunks().0.iter().take(12) {
        let count = count(&fields).max(1);
        let at = usize::from(u16::from_le_bytes([low, high])) % count;
        let from = usize::from(u16::from_le_bytes([other, more])) % count;
        let source = find(&mut fields, &mut { from }).map(|(fields, k)| fields[k].clone());
        let Some((parent, k)) = find(&mut fields, &mut { at }) else { break };
        let number = NUMBERS[usize::from(value) % NUMBERS.len()];
        match action % 8 {
            0 => drop(parent.remove(k)),
            1 => parent.insert(k, parent[k].clone()),
            2 => {
                if let Some(source) = source {
                    parent[k].content = source.content;
                }
            }
            3 => parent.extend(source),
            _ => change(&mut parent[k].content, number, value),
        }
    }
    written(&fields)
}

fn change(content: &mut Content, number: u64, value: u8) {
    let word = WORDS[usize::from(value) % WORDS.len()].as_bytes();
    match content {
        Content::Number(held) if value >= 128 => *held = held.wrapping_add(number),
        Content::Number(held) => *held = number,
        Content::Fixed(bytes) => bytes.fill(value),
        Content::Bytes(bytes) if value >= 192 => bytes.truncate(bytes.len() / 2),
        Content::Bytes(bytes) if value >= 160 => bytes.extend(bytes.clone()),
        // Whole numbers, as shapes and axes are stored.
        Content::Bytes(bytes) if value >= 96 && bytes.len().is_multiple_of(8) => {
            let last = bytes.len().saturating_sub(8);
            bytes.splice(last.., number.to_le_bytes());
        }
        Content::Bytes(bytes) if value >= 80 => bytes.fill(value.wrapping_mul(3)),
        Content::Bytes(bytes) => *bytes = word.to_vec(),
        Content::Message(fields) => fields.truncate(usize::from(value) % (fields.len() + 1)),
    }
}

/// The fields, those within messages included.
fn count(fields: &[Field]) -> usize {
    let of = |field: &Field| match &field.content {
        Content::Message(fields) => 1 + count(fields),
        _ => 1,
    };
    fields.iter().map(of).sum()
}

/// The message that holds the field after `left` others, and its place in it.
fn find<'a>(fields: &'a mut Vec<Field>, left: &mut usize) -> Option<(&'a mut Vec<Field>, usize)> {
    for k in 0..fields.len() {
        if *left == 0 {
            return Some((fields, k));
        }
        *left -= 1;
        let Content::Message(within) = &fields[k].content else { continue };
        let size = count(within);
        if *left >= size {
            *left -= size;
            continue;
        }
        let Content::Message(within) = &mut fields[k].content else { return None };
        return find(within, left);
    }
    None
}

/// The fields of a message; `None` if it is damaged.
fn read(mut data: &[u8], kind: Kind) -> Option<Vec<Field>> {
    let mut fields = Vec::new();
    while !data.is_empty() {
        let key = varint(&mut data)?;
        let number = key >> 3;
        let content = match key & 7 {
            0 => Content::Number(varint(&mut data)?),
            1 => Content::Fixed(data.split_off(..8)?.to_vec()),
            5 => Content::Fixed(data.split_off(..4)?.to_vec()),
            2 => {
                let length = usize::try_from(varint(&mut data)?).ok()?;
                let bytes = data.split_off(..length)?;
                let message = kind.within(number).and_then(|kind| read(bytes, kind));
                message.map_or_else(|| Content::Bytes(bytes.to_vec()), Content::Message)
            }
            _ => return None,
        };
        fields.push(Field { number, content });
    }
    Some(fields)
}

fn varint(data: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = *data.split_off_first()?;
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

fn written(fields: &[Field]) -> Vec<u8> {
    let mut out = Vec::new();
    for Field { number, content } in fields {
        let (kind, held) = match content {
            Content::Number(number) => (0, varint_of(*number)),
            Content::Fixed(bytes) => (if bytes.len() == 8 { 1 } else { 5 }, bytes.clone()),
            Content::Bytes(bytes) => (2, bytes.clone()),
            Content::Message(fields) => (2, written(fields)),
        };
        out.extend(varint_of(number << 3 | kind));
        if kind == 2 {
            out.extend(varint_of(held.len() as u64));
        }
        out.extend(held);
    }
    out
}

fn varint_of(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MADE_UP;

    #[test]
    fn without_changes_a_file_is_the_same_network() {
        for file in MADE_UP {
            assert_eq!(edited(file, &[]), file);
            let fields = read(file, Kind::Model).unwrap();
            assert!(count(&fields) > 200, "{}", count(&fields));
        }
    }

    #[test]
    fn every_field_can_be_removed() {
        let count = count(&read(MADE_UP[0], Kind::Model).unwrap());
        for k in 0..count {
            let [low, high] = (k as u16).to_le_bytes();
            assert!(edited(MADE_UP[0], &[low, high, 0, 0, 0, 0]).len() < MADE_UP[0].len(), "{k}");
        }
    }
}
