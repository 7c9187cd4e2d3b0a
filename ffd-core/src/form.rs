//! Lattices and sequences as data, for serde.
//!
//! A lattice is
//!
//! ```json
//! {"degree": [3, 3], "cells": [2, 1], "knots": ["uniform", "clamped"],
//!  "origin": [0, 0], "axes": [[1, 0], [0, 1]], "border": "free",
//!  "displacements": [[0, 0], [0.5, 0]]}
//! ```
//!
//! (with one displacement per control point), a sequence `{"sequence": [lattice, …]}`.
//! `knots` and `border` may be missing when read: then knots are uniform and the border
//! is free. Where a sequence is expected, a lattice is read as a sequence of one.
//!
//! Fields are read one by one, without an untagged enum, so that an error says what is
//! wrong with which list (`serde_json` adds line and column). Memory grows as numbers arrive: what the data say about
//! their own length is not believed. The format has to name its fields (as JSON does),
//! since they may come in any order.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::ser::{SerializeStruct, Serializer};
use serde::{Deserialize, Serialize};

use crate::{Border, Degree, Frame, Grid, Knots, Lattice, Sequence};

/// The fields of a lattice.
const LATTICE: &[&str] = &[
    "degree",
    "cells",
    "knots",
    "origin",
    "axes",
    "border",
    "displacements",
];

/// All fields that may occur where a sequence is expected.
const SEQUENCE: &[&str] = &[
    "sequence",
    "degree",
    "cells",
    "knots",
    "origin",
    "axes",
    "border",
    "displacements",
];

impl<const D: usize> Serialize for Lattice<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let grid = self.grid();
        let frame = grid.frame();
        let mut form = serializer.serialize_struct("Lattice", LATTICE.len())?;
        form.serialize_field("degree", &grid.degree().map(Degree::get)[..])?;
        form.serialize_field("cells", &grid.cells()[..])?;
        form.serialize_field("knots", &grid.knots()[..])?;
        form.serialize_field("origin", &frame.origin()[..])?;
        form.serialize_field("axes", &Rows(&frame.axes()))?;
        form.serialize_field("border", &grid.border())?;
        form.serialize_field("displacements", &Rows(self.displacements()))?;
        form.end()
    }
}

impl<const D: usize> Serialize for Sequence<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut form = serializer.serialize_struct("Sequence", 1)?;
        form.serialize_field("sequence", self.lattices())?;
        form.end()
    }
}

/// Points, written as a list of lists. (serde knows arrays of a generic length neither
/// here nor when reading.)
struct Rows<'a, const D: usize>(&'a [[f64; D]]);

impl<const D: usize> Serialize for Rows<'_, D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|row| &row[..]))
    }
}

impl<'de, const D: usize> Deserialize<'de> for Lattice<D> {
    fn deserialize<R: Deserializer<'de>>(deserializer: R) -> Result<Self, R::Error> {
        deserializer.deserialize_struct("Lattice", LATTICE, LatticeVisitor)
    }
}

impl<'de, const D: usize> Deserialize<'de> for Sequence<D> {
    fn deserialize<R: Deserializer<'de>>(deserializer: R) -> Result<Self, R::Error> {
        deserializer.deserialize_struct("Sequence", SEQUENCE, SequenceVisitor)
    }
}

struct LatticeVisitor<const D: usize>;

impl<'de, const D: usize> Visitor<'de> for LatticeVisitor<D> {
    type Value = Lattice<D>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a {D}-dimensional lattice")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Lattice<D>, A::Error> {
        let mut parts = Parts::default();
        while let Some(name) = map.next_key_seed(Name(LATTICE))? {
            parts.read(name, &mut map)?;
        }
        parts.assemble()
    }
}

struct SequenceVisitor<const D: usize>;

impl<'de, const D: usize> Visitor<'de> for SequenceVisitor<D> {
    type Value = Sequence<D>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a sequence of {D}-dimensional lattices, or one lattice")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Sequence<D>, A::Error> {
        let mut sequence = None;
        let mut parts = Parts::default();
        // The first field of a lattice that was met.
        let mut other = None;
        while let Some(name) = map.next_key_seed(Name(SEQUENCE))? {
            if name == "sequence" {
                set(
                    &mut sequence,
                    name,
                    map.next_value_seed(List::of(name, PhantomData)),
                )?;
            } else {
                other = other.or(Some(name));
                parts.read(name, &mut map)?;
            }
        }
        match (sequence, other) {
            (Some(lattices), None) => Ok(Sequence::new(lattices)),
            (Some(_), Some(name)) => Err(A::Error::custom(format_args!(
                "`{name}` belongs to a lattice and cannot stand beside `sequence`"
            ))),
            (None, Some(_)) => parts.assemble().map(Sequence::from),
            (None, None) => Err(A::Error::custom(
                "neither a `sequence` nor the fields of a lattice",
            )),
        }
    }
}

/// What has been read of a lattice.
#[derive(Default)]
struct Parts<const D: usize> {
    degree: Option<[usize; D]>,
    cells: Option<[usize; D]>,
    knots: Option<[Knots; D]>,
    origin: Option<[f64; D]>,
    axes: Option<[[f64; D]; D]>,
    border: Option<Border>,
    displacements: Option<Vec<[f64; D]>>,
}

impl<const D: usize> Parts<D> {
    /// Reads the value of a field of a lattice.
    fn read<'de, A: MapAccess<'de>>(
        &mut self,
        name: &'static str,
        map: &mut A,
    ) -> Result<(), A::Error> {
        let point = Array {
            name,
            nested: true,
            each: PhantomData::<f64>,
        };
        match name {
            "degree" => set(
                &mut self.degree,
                name,
                map.next_value_seed(Array::of(name, PhantomData)),
            ),
            "cells" => set(
                &mut self.cells,
                name,
                map.next_value_seed(Array::of(name, PhantomData)),
            ),
            "knots" => set(
                &mut self.knots,
                name,
                map.next_value_seed(Array::of(name, PhantomData)),
            ),
            "origin" => set(
                &mut self.origin,
                name,
                map.next_value_seed(Array::of(name, PhantomData)),
            ),
            "axes" => set(
                &mut self.axes,
                name,
                map.next_value_seed(Array::of(name, point)),
            ),
            "border" => set(&mut self.border, name, map.next_value()),
            "displacements" => set(
                &mut self.displacements,
                name,
                map.next_value_seed(List::of(name, point)),
            ),
            _ => Err(A::Error::unknown_field(name, LATTICE)),
        }
    }

    /// The lattice, if everything needed was there and fits.
    fn assemble<E: Error>(self) -> Result<Lattice<D>, E> {
        let numbers = required(self.degree, "degree")?;
        let cells = required(self.cells, "cells")?;
        let origin = required(self.origin, "origin")?;
        let axes = required(self.axes, "axes")?;
        let displacements = required(self.displacements, "displacements")?;
        let knots = self.knots.unwrap_or([Knots::default(); D]);
        let border = self.border.unwrap_or_default();

        let mut degree = [Degree::CUBIC; D];
        for (degree, number) in degree.iter_mut().zip(numbers) {
            *degree = Degree::new(number).map_err(E::custom)?;
        }
        Frame::new(origin, axes)
            .and_then(|frame| Grid::assemble(degree, cells, knots, frame, border))
            .and_then(|grid| Lattice::new(grid, displacements))
            .map_err(E::custom)
    }
}

fn required<T, E: Error>(value: Option<T>, name: &'static str) -> Result<T, E> {
    value.ok_or_else(|| E::missing_field(name))
}

/// Keeps the value of a field that must not come twice.
fn set<T, E: Error>(
    slot: &mut Option<T>,
    name: &'static str,
    value: Result<T, E>,
) -> Result<(), E> {
    match slot.replace(value?) {
        None => Ok(()),
        Some(_) => Err(E::duplicate_field(name)),
    }
}

/// Reads the name of a field, one of a list.
struct Name(&'static [&'static str]);

impl<'de> DeserializeSeed<'de> for Name {
    type Value = &'static str;

    fn deserialize<R: Deserializer<'de>>(self, deserializer: R) -> Result<&'static str, R::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for Name {
    type Value = &'static str;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a field")
    }

    fn visit_str<E: Error>(self, found: &str) -> Result<&'static str, E> {
        let known = self.0.iter().find(|&&name| name == found);
        known
            .copied()
            .ok_or_else(|| E::unknown_field(found, self.0))
    }
}

/// Reads exactly `D` entries, each by a seed.
#[derive(Clone, Copy)]
struct Array<S, const D: usize> {
    /// The field it stands in.
    name: &'static str,
    /// Whether it is an entry of that field, rather than its value.
    nested: bool,
    each: S,
}

impl<S, const D: usize> Array<S, D> {
    fn of(name: &'static str, each: S) -> Self {
        let nested = false;
        Self { name, nested, each }
    }
}

impl<'de, S: DeserializeSeed<'de> + Copy, const D: usize> DeserializeSeed<'de> for Array<S, D> {
    type Value = [S::Value; D];

    fn deserialize<R: Deserializer<'de>>(self, deserializer: R) -> Result<Self::Value, R::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, S: DeserializeSeed<'de> + Copy, const D: usize> Visitor<'de> for Array<S, D> {
    type Value = [S::Value; D];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let entry = if self.nested { "each entry of " } else { "" };
        write!(f, "{entry}`{}` to be a list of {D}", self.name)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
        let mut found: [Option<S::Value>; D] = std::array::from_fn(|_| None);
        for (i, entry) in found.iter_mut().enumerate() {
            *entry = entries.next_element_seed(self.each)?;
            if entry.is_none() {
                return Err(A::Error::invalid_length(i, &self));
            }
        }
        let mut count = D;
        while entries.next_element::<IgnoredAny>()?.is_some() {
            count += 1;
        }
        if count > D {
            return Err(A::Error::invalid_length(count, &self));
        }
        Ok(found.map(|entry| entry.expect("all were set")))
    }
}

/// Reads any number of entries, each by a seed.
struct List<S> {
    /// The field it is the value of.
    name: &'static str,
    each: S,
}

impl<S> List<S> {
    fn of(name: &'static str, each: S) -> Self {
        Self { name, each }
    }
}

impl<'de, S: DeserializeSeed<'de> + Copy> DeserializeSeed<'de> for List<S> {
    type Value = Vec<S::Value>;

    fn deserialize<R: Deserializer<'de>>(self, deserializer: R) -> Result<Self::Value, R::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, S: DeserializeSeed<'de> + Copy> Visitor<'de> for List<S> {
    type Value = Vec<S::Value>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` to be a list", self.name)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
        let mut list = Vec::new();
        while let Some(entry) = entries.next_element_seed(self.each)? {
            list.push(entry);
        }
        Ok(list)
    }
}
