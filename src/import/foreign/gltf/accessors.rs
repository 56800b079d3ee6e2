//! Accessors: numbers in buffers, read element by element after one check of their bounds. Bytes need no alignment to
//! be read.

use std::collections::BTreeMap;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, accessor};

use super::GltfSource;
use crate::error::Result;

/// The elements of an accessor.
#[derive(Clone, Debug)]
pub(crate) struct Column<'a> {
    /// From the first element on; without bytes all elements are zero.
    bytes: Option<&'a [u8]>,
    stride: usize,
    count: usize,
    kind: ComponentType,
    normalized: bool,
    /// Elements that stand elsewhere.
    sparse: BTreeMap<usize, &'a [u8]>,
    /// Numbers of an element.
    width: usize,
}

impl Column<'_> {
    /// How many elements there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// How many numbers an element has.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The bytes of an element; none for zeros and beyond the end.
    fn element(&self, i: usize) -> &[u8] {
        match self.sparse.get(&i) {
            Some(bytes) => bytes,
            None => self.bytes.and_then(|bytes| bytes.get(i * self.stride..)).unwrap_or_default(),
        }
    }

    /// The first numbers of an element as floats, whole ones in proportion if they are normalized; zero where there are
    /// none.
    pub fn floats<const N: usize>(&self, i: usize) -> [f32; N] {
        let element = self.element(i);
        std::array::from_fn(|k| if k < self.width { self.float(element, k) } else { 0.0 })
    }

    fn float(&self, element: &[u8], k: usize) -> f32 {
        let scaled = |value: f32, largest: f32| if self.normalized { (value / largest).max(-1.0) } else { value };
        match self.kind {
            ComponentType::F32 => f32::from_le_bytes(bytes_at(element, 4 * k)),
            ComponentType::U8 => scaled(f32::from(u8::from_le_bytes(bytes_at(element, k))), 255.0),
            ComponentType::I8 => scaled(f32::from(i8::from_le_bytes(bytes_at(element, k))), 127.0),
            ComponentType::U16 => scaled(f32::from(u16::from_le_bytes(bytes_at(element, 2 * k))), 65_535.0),
            ComponentType::I16 => scaled(f32::from(i16::from_le_bytes(bytes_at(element, 2 * k))), 32_767.0),
            ComponentType::U32 => scaled(u32::from_le_bytes(bytes_at(element, 4 * k)) as f32, u32::MAX as f32),
        }
    }

    /// The first numbers of an element as indices; zero where there are none.
    pub fn indices<const N: usize>(&self, i: usize) -> [u32; N] {
        let element = self.element(i);
        std::array::from_fn(|k| if k < self.width { index(self.kind, element, k) } else { 0 })
    }
}

fn index(kind: ComponentType, element: &[u8], k: usize) -> u32 {
    match kind {
        ComponentType::U8 | ComponentType::I8 => u32::from(u8::from_le_bytes(bytes_at(element, k))),
        ComponentType::U16 | ComponentType::I16 => u32::from(u16::from_le_bytes(bytes_at(element, 2 * k))),
        ComponentType::U32 | ComponentType::F32 => u32::from_le_bytes(bytes_at(element, 4 * k)),
    }
}

/// Bytes at a place; zeros beyond the end.
fn bytes_at<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    bytes.get(at..at + N).and_then(|bytes| bytes.try_into().ok()).unwrap_or([0; N])
}

/// The use of an accessor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AccessorUse {
    Floats,
    Indices,
}

impl<'a> GltfSource<'a> {
    /// The elements of an accessor that `path` names, which must be of one of these types.
    pub fn column(
        &self,
        path: &str,
        index: Index<accessor::Accessor>,
        types: &[Type],
        accessor_use: AccessorUse,
    ) -> Result<Column<'a>> {
        let place = format!("{path} (accessors[{}])", index.value());
        self.checked_column(index, types, accessor_use).map_err(|message| self.fault(&place, message))
    }

    fn checked_column(
        &self,
        index: Index<accessor::Accessor>,
        types: &[Type],
        accessor_use: AccessorUse,
    ) -> Result<Column<'a>, String> {
        let accessor = self.root.get(index).ok_or("no such accessor")?;
        let (Checked::Valid(kind), Checked::Valid(type_)) = (accessor.component_type, accessor.type_) else {
            return Err("the type is not one of glTF".into());
        };
        let kind = kind.0;
        if !types.contains(&type_) {
            return Err(format!(
                "has elements of type {}, but {} is needed",
                name(type_),
                types.iter().map(|t| name(*t)).collect::<Vec<_>>().join(" or ")
            ));
        }
        if accessor_use == AccessorUse::Indices
            && !matches!(kind, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
        {
            return Err("has numbers that are no indices".into());
        }
        let (width, size) = (type_.multiplicity(), kind.size());
        if matches!(type_, Type::Mat2 | Type::Mat3 | Type::Mat4) && kind != ComponentType::F32 {
            return Err("has a matrix whose numbers are not floats".into());
        }
        let count = usize::try_from(accessor.count.0).map_err(|_| "has too many elements")?;
        let element = width * size;
        let mut column = Column {
            bytes: None,
            stride: element,
            count,
            kind,
            normalized: accessor.normalized,
            sparse: BTreeMap::new(),
            width,
        };
        if let Some(view) = accessor.buffer_view {
            let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
            (column.bytes, column.stride) = self.elements(view.value(), offset, count, element)?;
        } else if count > self.buffers.total().saturating_add(MAX_ZEROS) {
            return Err(format!("claims {count} elements without data, more than the file has bytes"));
        }
        if let Some(sparse) = &accessor.sparse {
            column.sparse = self.sparse(sparse, count, element)?;
        }
        Ok(column)
    }

    /// The bytes of elements in a view from the first on, and from one to the next.
    fn elements(
        &self,
        view: usize,
        offset: u64,
        count: usize,
        size: usize,
    ) -> Result<(Option<&'a [u8]>, usize), String> {
        let json = self.root.buffer_views.get(view).ok_or("no such view")?;
        let view_of = self.buffers.view(json).map_err(|message| format!("bufferViews[{view}]: {message}"))?;
        let stride = view_of.stride.unwrap_or(size);
        if stride < size {
            return Err(format!("elements of {size} bytes stand {stride} bytes apart in bufferViews[{view}]"));
        }
        let last = (count as u64).saturating_sub(1).checked_mul(stride as u64);
        let end = last.and_then(|last| last.checked_add(offset)?.checked_add(if count > 0 { size as u64 } else { 0 }));
        if end.is_none_or(|end| end > view_of.bytes.len() as u64) {
            return Err(format!(
                "{count} elements do not fit into bufferViews[{view}], which has {} bytes",
                view_of.bytes.len()
            ));
        }
        Ok((view_of.bytes.get(offset as usize..), stride))
    }

    fn sparse(
        &self,
        sparse: &accessor::sparse::Sparse,
        count: usize,
        element: usize,
    ) -> Result<BTreeMap<usize, &'a [u8]>, String> {
        let replaced = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
        if replaced > count {
            return Err(format!("replaces {replaced} of {count} elements"));
        }
        let Checked::Valid(kind) = sparse.indices.component_type else {
            return Err("the type of its sparse indices is not one of glTF".into());
        };
        let size = kind.0.size();
        let (indices, index_stride) =
            self.elements(sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0, replaced, size)?;
        let (values, stride) =
            self.elements(sparse.values.buffer_view.value(), sparse.values.byte_offset.0, replaced, element)?;
        let (indices, values) = (indices.unwrap_or_default(), values.unwrap_or_default());
        let mut map = BTreeMap::new();
        for i in 0..replaced {
            let at = index(kind.0, indices.get(i * index_stride..).unwrap_or_default(), 0) as usize;
            if at >= count {
                return Err(format!("replaces element {at} of {count}"));
            }
            map.insert(at, values.get(i * stride..i * stride + element).unwrap_or_default());
        }
        Ok(map)
    }
}

/// Elements without data that a file of any size may claim.
const MAX_ZEROS: usize = 1 << 16;

fn name(type_: Type) -> &'static str {
    match type_ {
        Type::Scalar => "SCALAR",
        Type::Vec2 => "VEC2",
        Type::Vec3 => "VEC3",
        Type::Vec4 => "VEC4",
        Type::Mat2 => "MAT2",
        Type::Mat3 => "MAT3",
        Type::Mat4 => "MAT4",
    }
}
