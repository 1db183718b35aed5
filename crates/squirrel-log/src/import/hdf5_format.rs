//! HDF5, and with it MATLAB's MAT-files v7.3: which arrays of numbers are in them.
//!
//! A group is a structure, a dataset a variable or a field; the fields of a dataset of records are
//! fields as well. Sizes are listed from the slowest to the fastest, so that they are turned round
//! here: as MATLAB states them, numbers then stand column by column.
//!
//! MATLAB writes HDF5 behind 512 bytes of its own, with the class of each variable as an attribute.
//! A field of a list of structures is a dataset of references to what each element holds.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;

use hdf5_reader::error::Error;
use hdf5_reader::group::Group;
use hdf5_reader::messages::datatype::ReferenceType;
use hdf5_reader::reference::read_object_references;
use hdf5_reader::{ByteOrder, Dataset, Datatype, Hdf5File, OpenOptions};

use super::array_file::{ARRAYS_MAX, Array, Arrays, DEPTH_MAX, Numbers};
use super::number::Kind;
use crate::files::Budget;

/// Where MATLAB keeps what references point to.
const REFERENCES: &str = "#refs#";
/// Attributes of MATLAB: the class of a variable; that a dataset holds its sizes, not its numbers;
/// that a group is a sparse matrix.
const CLASS: &str = "MATLAB_class";
const EMPTY: &str = "MATLAB_empty";
const SPARSE: &str = "MATLAB_sparse";
/// Classes that are numbers. Text, cells, dates and other objects are not.
const NUMERIC: [&str; 11] = [
    "double", "single", "logical", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64",
    "uint64",
];

/// The arrays of a file.
pub(super) struct Hdf5 {
    all: Vec<Array>,
    /// Of each array: which dataset. Fields of records share one.
    places: Vec<usize>,
    datasets: Vec<(Dataset, Option<Vec<u8>>)>,
}

impl Arrays for Hdf5 {
    fn all(&self) -> &[Array] {
        &self.all
    }

    fn bytes(&mut self, index: usize, budget: &mut Budget) -> Result<&[u8], String> {
        let (dataset, read) = &mut self.datasets[self.places[index]];
        if read.is_none() {
            *read = Some(bytes_of(dataset, budget)?);
        }
        Ok(read.as_deref().unwrap_or_default())
    }
}

impl Hdf5 {
    /// Finds the arrays of a file.
    ///
    /// # Errors
    /// Says what is wrong.
    pub(super) fn read(bytes: Vec<u8>, budget: &mut Budget) -> Result<Self, String> {
        let most = usize::try_from(budget.left()).unwrap_or(usize::MAX);
        // What is read is kept here, once.
        let options = OpenOptions::default()
            .with_chunk_cache_bytes(0)
            .with_max_chunk_bytes(most)
            .with_max_read_bytes(most);
        let file = Hdf5File::from_vec_with_options(bytes, options).map_err(said)?;
        let root = file.root_group().map_err(said)?;
        let mut finder = Finder {
            found: Self { all: Vec::new(), places: Vec::new(), datasets: Vec::new() },
            offset_size: root.offset_size(),
            root: &root,
            referred: None,
            seen: BTreeSet::new(),
            looked_at: 0,
            budget,
        };
        finder.group(&root, "", 0)?;
        Ok(finder.found)
    }
}

/// What a reference points to.
enum Referred {
    Group(Group),
    Dataset(Box<Dataset>),
}

/// Goes through a file.
struct Finder<'a> {
    found: Hdf5,
    root: &'a Group,
    offset_size: u8,
    /// What references point to, by its place in the file; listed when the first one is met.
    referred: Option<BTreeMap<u64, Referred>>,
    /// Groups that have been gone through: links may lead round in a circle.
    seen: BTreeSet<u64>,
    /// Datasets that have been looked at: so may references.
    looked_at: usize,
    budget: &'a mut Budget,
}

impl Finder<'_> {
    fn group(&mut self, group: &Group, path: &str, depth: usize) -> Result<(), String> {
        if depth == DEPTH_MAX {
            return Err(format!("a variable is nested more than {DEPTH_MAX} deep"));
        }
        if !self.seen.insert(group.address()) || group.attribute(SPARSE).is_ok() {
            return Ok(());
        }
        let (groups, datasets) = group.member_names().map_err(said)?;
        for name in datasets {
            let dataset = group.dataset(&name).map_err(said)?;
            self.dataset(&dataset, &inside(path, &name), depth)?;
        }
        for name in groups {
            // MATLAB's own: what references point to, and what its objects consist of.
            if !(depth == 0 && name.starts_with('#')) {
                let group = group.group(&name).map_err(said)?;
                self.group(&group, &inside(path, &name), depth + 1)?;
            }
        }
        Ok(())
    }

    fn dataset(&mut self, dataset: &Dataset, path: &str, depth: usize) -> Result<(), String> {
        self.looked_at += 1;
        if self.looked_at > ARRAYS_MAX {
            return Err(format!("more than {ARRAYS_MAX} datasets"));
        }
        let class = dataset.attribute(CLASS).ok().map(|class| class.read_string());
        let class = class.transpose().map_err(said)?;
        if dataset.attribute(EMPTY).is_ok() {
            return Ok(());
        }
        match (dataset.dtype(), class) {
            // Cells have a class, the fields of a list of structures have none.
            (Datatype::Reference { ref_type: ReferenceType::Object, .. }, None) => {
                self.elements(dataset, path, depth)
            }
            (_, Some(class)) if !NUMERIC.contains(&class.as_str()) => Ok(()),
            (Datatype::Compound { size, fields }, None) => {
                for field in fields {
                    if let Some((kind, big_endian)) = numeric(&field.datatype) {
                        let offset = field.byte_offset as usize;
                        let stride = *size as usize;
                        let numbers = Numbers { kind, big_endian, offset, stride };
                        self.array(dataset, inside(path, &field.name), numbers)?;
                    }
                }
                self.found.datasets.push((dataset.clone(), None));
                Ok(())
            }
            (other, _) => {
                if let Some((kind, big_endian)) = numeric(other) {
                    self.array(dataset, path.to_owned(), Numbers::dense(kind, big_endian))?;
                    self.found.datasets.push((dataset.clone(), None));
                }
                Ok(())
            }
        }
    }

    /// Adds an array of the dataset that is added next.
    fn array(&mut self, dataset: &Dataset, path: String, numbers: Numbers) -> Result<(), String> {
        // Of records, each field is one.
        if self.found.all.len() == ARRAYS_MAX {
            return Err(format!("more than {ARRAYS_MAX} arrays"));
        }
        let sizes = dataset.shape().iter().rev().filter(|size| **size != 1);
        let sizes = sizes.map(|size| usize::try_from(*size)).collect::<Result<Vec<_>, _>>();
        let sizes = sizes.map_err(|_| format!("`{path}` is too large"))?;
        self.found.all.push(Array { path, sizes, numbers });
        self.found.places.push(self.found.datasets.len());
        Ok(())
    }

    /// Adds what the elements of a list of structures hold in one field: `log.imu[0].gyro` of
    /// `log.imu.gyro`.
    fn elements(&mut self, field: &Dataset, path: &str, depth: usize) -> Result<(), String> {
        let bytes = bytes_of(field, self.budget)?;
        let addresses = read_object_references(&bytes, self.offset_size).map_err(said)?;
        let (list, name) = path.rsplit_once('.').unwrap_or(("", path));
        for (index, address) in addresses.into_iter().enumerate() {
            let path = inside(&format!("{list}[{index}]"), name);
            // Borrowed apart: what it points to is listed by `self` as well.
            let referred = match self.referred()?.get(&address) {
                Some(Referred::Group(group)) => Referred::Group(group.clone()),
                Some(Referred::Dataset(dataset)) => Referred::Dataset(dataset.clone()),
                None => continue,
            };
            match referred {
                Referred::Group(group) => self.group(&group, &path, depth + 1)?,
                Referred::Dataset(dataset) if depth + 1 < DEPTH_MAX => {
                    self.dataset(&dataset, &path, depth + 1)?;
                }
                Referred::Dataset(_) => {}
            }
        }
        Ok(())
    }

    fn referred(&mut self) -> Result<&BTreeMap<u64, Referred>, String> {
        if self.referred.is_none() {
            let mut all = BTreeMap::new();
            if let Ok(group) = self.root.group(REFERENCES) {
                let (groups, datasets) = group.members().map_err(said)?;
                for group in groups {
                    all.insert(group.address(), Referred::Group(group));
                }
                for dataset in datasets {
                    all.insert(dataset.address(), Referred::Dataset(Box::new(dataset)));
                }
            }
            self.referred = Some(all);
        }
        Ok(self.referred.get_or_insert_default())
    }
}

/// All bytes of a dataset, taken from the budget.
fn bytes_of(dataset: &Dataset, budget: &mut Budget) -> Result<Vec<u8>, String> {
    let size = dataset.raw_byte_len().map_err(said)?;
    budget.take(size as u64).map_err(said)?;
    dataset.read_raw_bytes().map_err(unread)
}

fn inside(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}

/// How a number is stored, and whether its first byte is its largest; `None` for text and the like.
fn numeric(datatype: &Datatype) -> Option<(Kind, bool)> {
    let (kind, order) = match datatype {
        Datatype::FixedPoint { size, signed, byte_order } => {
            let kind = match (size, signed) {
                (1, true) => Kind::I8,
                (1, false) => Kind::U8,
                (2, true) => Kind::I16,
                (2, false) => Kind::U16,
                (4, true) => Kind::I32,
                (4, false) => Kind::U32,
                (8, true) => Kind::I64,
                (8, false) => Kind::U64,
                _ => return None,
            };
            (kind, byte_order)
        }
        Datatype::FloatingPoint { size, byte_order } => {
            let kind = match size {
                2 => Kind::F16,
                4 => Kind::F32,
                8 => Kind::F64,
                _ => return None,
            };
            (kind, byte_order)
        }
        // Truths of Python.
        Datatype::Enum { base, .. } => return numeric(base),
        _ => return None,
    };
    Some((kind, *order == ByteOrder::BigEndian))
}

fn said(problem: impl Display) -> String {
    problem.to_string()
}

/// Why the numbers of a dataset cannot be read; which dataset it is says who asks.
fn unread(error: Error) -> String {
    match error {
        Error::Context { source, .. } => unread(*source),
        Error::UnsupportedFilter(filter) => format!(
            "packed by what is not read ({filter}); `h5repack -f GZIP=4 FILE OTHER` packs it by gzip"
        ),
        other => other.to_string(),
    }
}
