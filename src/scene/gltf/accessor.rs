//! Typed data of a document, with every offset and length checked.

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

use super::document::Document;
use crate::scene::Rgb;
use crate::scene::source::{EXPORT_AGAIN, ImportError, Place};

/// A run of equal elements in a buffer view.
struct Layout {
    offset: u64,
    count: usize,
    component: ComponentType,
    components: usize,
    normalized: bool,
}

/// Most elements of a sparse accessor without a buffer view, unless buffers have more bytes.
const MOST_ZEROS: usize = 1 << 16;

impl Document<'_> {
    /// All components of an accessor one after the other; integers that the file declares as
    /// normalized become 0..1 or -1..1.
    pub fn components(&self, index: usize, kind: Type) -> Result<Vec<f64>, ImportError> {
        let fail = |problem: String| self.broken(index, problem);
        let Some(accessor) = self.root.accessors.get(index) else {
            return Err(fail("does not exist".into()));
        };
        let (Checked::Valid(component), Checked::Valid(found)) =
            (accessor.component_type, accessor.type_)
        else {
            return Err(fail("has an unknown type".into()));
        };
        if found != kind {
            return Err(fail(format!("is {found:?} instead of {kind:?}")));
        }
        let layout = Layout {
            offset: accessor.byte_offset.unwrap_or_default().0,
            count: usize::try_from(accessor.count.0).unwrap_or(usize::MAX),
            component: component.0,
            components: kind.multiplicity(),
            normalized: accessor.normalized,
        };
        self.source.check_size(layout.count, "elements", || place(index))?;
        let mut values = match accessor.buffer_view {
            Some(view) => self.strided(index, view.value(), &layout)?,
            None if accessor.sparse.is_some() => {
                // A file of a few bytes could ask for gigabytes of zeros.
                let bytes: usize = self.buffers.iter().flatten().map(|b| b.len()).sum();
                if layout.count > bytes.max(MOST_ZEROS) {
                    let problem = "elements are zeros that no buffer holds";
                    return Err(fail(format!("nearly all of its {} {problem}", layout.count)));
                }
                vec![0.0; layout.count * layout.components]
            }
            None => return Err(fail("has no data".into())),
        };
        if let Some(sparse) = &accessor.sparse {
            let count = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
            let Checked::Valid(component) = sparse.indices.component_type else {
                return Err(fail("has sparse indices of an unknown type".into()));
            };
            let indices = Layout {
                offset: sparse.indices.byte_offset.0,
                count,
                component: component.0,
                components: 1,
                normalized: false,
            };
            let indices = self.strided(index, sparse.indices.buffer_view.value(), &indices)?;
            let replaced = Layout { offset: sparse.values.byte_offset.0, count, ..layout };
            let replaced = self.strided(index, sparse.values.buffer_view.value(), &replaced)?;
            let width = layout.components;
            for (i, value) in indices.into_iter().zip(replaced.chunks_exact(width)) {
                let at = i as usize * width;
                match values.get_mut(at..at + width) {
                    Some(target) => target.copy_from_slice(value),
                    None => return Err(fail(format!("its sparse index {i} is out of range"))),
                }
            }
        }
        Ok(values)
    }

    /// Colours of vertices, in linear light; alpha is passed over.
    pub fn colours(&self, index: usize) -> Result<Vec<Rgb>, ImportError> {
        let found = self.root.accessors.get(index).map(|a| a.type_);
        let kind = match found {
            Some(Checked::Valid(Type::Vec4)) => Type::Vec4,
            _ => Type::Vec3,
        };
        let values = self.components(index, kind)?;
        Ok(values.chunks_exact(kind.multiplicity()).map(|c| Rgb::new(c[0], c[1], c[2])).collect())
    }

    /// Vertex indices.
    pub fn indices(&self, index: usize) -> Result<Vec<u32>, ImportError> {
        let component = self.root.accessors.get(index).map(|a| a.component_type);
        if let Some(Checked::Valid(component)) = component
            && !matches!(component.0, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
        {
            return Err(self.broken(index, format!("holds {:?} as indices", component.0)));
        }
        Ok(self.components(index, Type::Scalar)?.into_iter().map(|i| i as u32).collect())
    }

    fn strided(&self, index: usize, view: usize, l: &Layout) -> Result<Vec<f64>, ImportError> {
        let (bytes, stride) = self.view(view)?;
        let width = l.component.size();
        let size = width * l.components;
        let stride = stride.unwrap_or(size);
        let fits = || {
            let start = usize::try_from(l.offset).ok()?;
            let end = l.count.checked_sub(1)?.checked_mul(stride)?.checked_add(size)?;
            bytes.get(start..start.checked_add(end)?)
        };
        if l.count == 0 {
            return Ok(Vec::new());
        }
        let Some(bytes) = fits() else {
            return Err(self.broken(
                index,
                format!(
                    "its {} elements go beyond the {} bytes of buffer view {view}",
                    l.count,
                    bytes.len()
                ),
            ));
        };
        let mut values = Vec::with_capacity(l.count * l.components);
        for i in 0..l.count {
            let element = &bytes[i * stride..i * stride + size];
            values.extend(element.chunks_exact(width).map(|c| component(c, l)));
        }
        Ok(values)
    }

    fn broken(&self, index: usize, problem: String) -> ImportError {
        self.source.malformed(place(index), problem, EXPORT_AGAIN)
    }
}

fn place(index: usize) -> Place {
    Place::Element(format!("accessor {index}"))
}

fn component(c: &[u8], layout: &Layout) -> f64 {
    let (value, largest) = match (layout.component, c) {
        (ComponentType::I8, &[a]) => (f64::from(a as i8), 127.0),
        (ComponentType::U8, &[a]) => (f64::from(a), 255.0),
        (ComponentType::I16, &[a, b]) => (f64::from(i16::from_le_bytes([a, b])), 32_767.0),
        (ComponentType::U16, &[a, b]) => (f64::from(u16::from_le_bytes([a, b])), 65_535.0),
        (ComponentType::U32, &[a, b, c, d]) => {
            (f64::from(u32::from_le_bytes([a, b, c, d])), 4_294_967_295.0)
        }
        (ComponentType::F32, &[a, b, c, d]) => {
            return f64::from(f32::from_le_bytes([a, b, c, d]));
        }
        // `chunks_exact` hands out the component's width.
        _ => return f64::NAN,
    };
    if layout.normalized { (value / largest).max(-1.0) } else { value }
}
