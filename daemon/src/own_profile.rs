//! A profile as it stands in a file: the engine's settings and, in the same table, the one that is the queue's.

use std::fmt;

use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, Error, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, forward_to_deserialize_any};
use suture_core::Profile;
use suture_store::Priority;

/// The queue's setting.
const PRIORITY: &str = "priority";

/// A profile of someone's own.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct OwnProfile {
    /// What the engine works by.
    #[serde(flatten)]
    pub profile: Profile,
    /// How soon files of this profile are wanted, if it says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub priority: Option<Priority>,
}

impl<'de> Deserialize<'de> for OwnProfile {
    // Serde's own way to flatten knows neither what is unknown nor on which line it stands.
    fn deserialize<D: Deserializer<'de>>(inner: D) -> Result<Self, D::Error> {
        let mut priority = None;
        let profile = Profile::deserialize(Aside { inner, priority: &mut priority })?;
        Ok(Self { profile, priority })
    }
}

/// Sets the queue's setting aside while the engine reads its own, be it a deserializer, a visitor or a table.
struct Aside<'a, T> {
    inner: T,
    priority: &'a mut Option<Priority>,
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Aside<'_, D> {
    type Error = D::Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.inner.deserialize_map(Aside { inner: visitor, priority: self.priority })
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct newtype_struct seq
        tuple tuple_struct map struct enum identifier ignored_any
    }
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Aside<'_, V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.inner.expecting(f)
    }

    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<V::Value, M::Error> {
        self.inner.visit_map(Aside { inner: map, priority: self.priority })
    }
}

impl<'de, M: MapAccess<'de>> MapAccess<'de> for Aside<'_, M> {
    type Error = M::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, M::Error> {
        let mut seed = Some(seed);
        loop {
            match self.inner.next_key_seed(Key(&mut seed))? {
                None => return Ok(None),
                Some(Some(key)) => return Ok(Some(key)),
                Some(None) => *self.priority = Some(self.inner.next_value()?),
            }
        }
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, M::Error> {
        self.inner.next_value_seed(seed)
    }
}

/// A setting's name: `None` for the queue's; whether the engine knows it, its own reader says, here, where the line is known.
struct Key<'a, K>(&'a mut Option<K>);

impl<'de, K: DeserializeSeed<'de>> DeserializeSeed<'de> for Key<'_, K> {
    type Value = Option<K::Value>;

    fn deserialize<D: Deserializer<'de>>(self, d: D) -> Result<Self::Value, D::Error> {
        d.deserialize_identifier(self)
    }
}

impl<'de, K: DeserializeSeed<'de>> Visitor<'de> for Key<'_, K> {
    type Value = Option<K::Value>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a setting")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
        if name == PRIORITY {
            return Ok(None);
        }
        let seed = self.0.take().ok_or_else(|| E::custom("a setting has two names"))?;
        let name: StrDeserializer<'_, E> = name.into_deserializer();
        seed.deserialize(name).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profiles::parse;

    #[test]
    fn the_queues_setting_stands_among_the_engines() {
        let own: OwnProfile = parse("max_hole_edges = 7\npriority = 8\nfill_holes = false\n").unwrap();
        assert_eq!((own.priority, own.profile.max_hole_edges, own.profile.fill_holes), (Priority::try_from(8).ok(), 7, false));
        let none: OwnProfile = parse("").unwrap();
        assert_eq!(none, OwnProfile::default());
        let shown = toml::to_string(&own).unwrap();
        assert_eq!(parse::<OwnProfile>(&shown).unwrap(), own);
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        for (text, words) in [
            ("priority = 1\nfill_holse = true", "line 2, `fill_holse = true`: unknown field `fill_holse`"),
            ("fill_holes = true\npriority = 10", "line 2, `priority = 10`: a priority is a whole number from 0 to 9"),
            ("priority = -1", "line 1, `priority = -1`: a priority is a whole number from 0 to 9, the higher the sooner, not -1"),
            ("priority = \"high\"", "line 1, `priority = \"high\"`: invalid type: string"),
            ("\nfill_holes = 3", "line 2, `fill_holes = 3`: invalid type: integer"),
        ] {
            let error = parse::<OwnProfile>(text).unwrap_err();
            assert!(error.starts_with(words), "{words}: {error}");
        }
    }
}
