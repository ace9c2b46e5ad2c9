//! GPU structs: one declaration in Rust, compared with the shader's by reflection in a test.

/// A field of a GPU struct as Rust lays it out: name, offset and size in bytes.
pub type Field = (&'static str, usize, usize);

/// A struct shared with shaders, plain bytes on both sides.
pub trait GpuStruct: bytemuck::Pod {
    /// Its name in WGSL.
    const NAME: &'static str;
    /// Its fields.
    const FIELDS: &'static [Field];
}

/// Declares a `#[repr(C)]` struct of plain bytes and records its fields for the layout test.
macro_rules! gpu_struct {
    ($(#[$doc:meta])* $Name:ident { $( $(#[$field_doc:meta])* $field:ident: $Type:ty, )* }) => {
        $(#[$doc])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $Name { $( $(#[$field_doc])* pub $field: $Type, )* }
        impl $crate::gpu::layout::GpuStruct for $Name {
            const NAME: &'static str = stringify!($Name);
            const FIELDS: &'static [$crate::gpu::layout::Field] = &[ $( (
                stringify!($field),
                std::mem::offset_of!($Name, $field),
                std::mem::size_of::<$Type>(),
            ) ),* ];
        }
    };
}
pub(crate) use gpu_struct;

/// Compares a struct with the one of the same name in a shader module; the first difference in words.
pub fn compare<T: GpuStruct>(module: &wgpu::naga::Module) -> Result<(), String> {
    use wgpu::naga::TypeInner;
    let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(T::NAME));
    let Some((_, ty)) = found else { return Err(format!("no struct {} in the shader", T::NAME)) };
    let TypeInner::Struct { members, span } = &ty.inner else { return Err(format!("{} is no struct", T::NAME)) };
    if *span as usize != std::mem::size_of::<T>() {
        return Err(format!("{}: {} bytes in WGSL, {} in Rust", T::NAME, span, std::mem::size_of::<T>()));
    }
    for (i, member) in members.iter().enumerate() {
        let size = module.types[member.ty].inner.size(module.to_ctx()) as usize;
        let wgsl = (member.name.as_deref().unwrap_or_default(), member.offset as usize, size);
        match T::FIELDS.get(i) {
            Some(rust) if *rust == wgsl => {}
            rust => return Err(format!("{} field {i}: rust {rust:?}, wgsl {wgsl:?}", T::NAME)),
        }
    }
    if members.len() != T::FIELDS.len() {
        return Err(format!("{}: {} fields in WGSL, {} in Rust", T::NAME, members.len(), T::FIELDS.len()));
    }
    Ok(())
}
