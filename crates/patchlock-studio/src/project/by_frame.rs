//! Maps from frames to what is in them, as JSON objects. JSON has only texts as names, and inside a
//! tagged enum serde hands them over as texts, which it can't read as numbers by itself.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};
use serde::ser::{Serialize, Serializer};

pub fn serialize<V: Serialize, S: Serializer>(
    map: &BTreeMap<usize, V>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(map)
}

pub fn deserialize<'de, V: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<BTreeMap<usize, V>, D::Error> {
    deserializer.deserialize_map(Frames(PhantomData))
}

struct Frames<V>(PhantomData<V>);

impl<'de, V: Deserialize<'de>> Visitor<'de> for Frames<V> {
    type Value = BTreeMap<usize, V>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object whose names are frames")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<Self::Value, A::Error> {
        let mut map = BTreeMap::new();
        while let Some(name) = access.next_key::<String>()? {
            let frame = name.parse().map_err(|_| {
                A::Error::custom(format!("{name:?} is not a frame; frames count from 0"))
            })?;
            if map.insert(frame, access.next_value()?).is_some() {
                return Err(A::Error::custom(format!("frame {frame} appears twice")));
            }
        }
        Ok(map)
    }
}
