//! Intel Open Image Denoise, opened at run time: a device on the processor, and its filter on pictures in memory.
//!
//! One of the two homes of `unsafe`. The library stays loaded until the process ends, since its threads outlive its
//! devices.

mod sys;

use std::ffi::{CStr, c_char, c_int};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::ptr::{NonNull, null};

use libloading::Library;

use crate::error::{Error, Result};
use sys::{Functions, OidnDevice, OidnFilter};

/// The major version that the declarations are those of.
const MAJOR: u32 = 2;

/// Red, green and blue, or the three coordinates of a normal.
pub type Triple = [f32; 3];

/// What a filter is given; every picture has as many pixels as the output.
#[derive(Clone, Copy, Default)]
pub struct Inputs<'a> {
    /// The picture to denoise.
    pub color: Option<&'a [Triple]>,
    /// Albedo, 0 to 1; to be denoised itself if there is no colour.
    pub albedo: Option<&'a [Triple]>,
    /// Normals, -1 to 1; to be denoised themselves if there is nothing else.
    pub normal: Option<&'a [Triple]>,
    /// Whether colours go beyond 1.
    pub hdr: bool,
    /// Whether albedo and normal are free of noise.
    pub clean_features: bool,
}

/// A device of the library: the processor.
pub struct Device {
    functions: Functions,
    handle: NonNull<OidnDevice>,
    version: [u32; 3],
    file: PathBuf,
    _library: ManuallyDrop<Library>,
}

/// Why a file cannot serve as the library.
#[derive(Debug)]
pub struct Unusable(pub String);

impl Device {
    /// Opens a library by its path, or by its bare name where the system looks for libraries, with `threads` threads
    /// (0: all).
    pub fn open(file: &Path, threads: usize) -> Result<Self, Unusable> {
        // SAFETY: opening runs the library's initialisers. The file is named by the user, or has the name of a library
        // known to be fit.
        let library = unsafe { Library::new(file) }.map_err(|e| Unusable(loader_message(&e)))?;
        let library = ManuallyDrop::new(library);
        // SAFETY: the types are those of version 2, which is checked below before anything but the version is looked up
        // in it; the library is never closed.
        let functions = unsafe { Functions::find(&library) }.map_err(|missing| {
            // SAFETY: the symbol is only looked for, not called.
            let old = unsafe { library.get::<unsafe extern "C" fn()>(sys::OF_VERSION_1) }.is_ok();
            let why = if old {
                "it is Open Image Denoise 1; version 2 is needed".to_owned()
            } else {
                format!("it is not Open Image Denoise 2: it has no {missing}")
            };
            Unusable(why)
        })?;
        // SAFETY: a call without preconditions.
        let handle = NonNull::new(unsafe { (functions.new_device)(sys::DEVICE_TYPE_CPU) });
        let handle = handle.ok_or_else(|| {
            Unusable(
                last_error(&functions, std::ptr::null_mut())
                    .map_or("it supports no processor of this kind".to_owned(), |e| e.message),
            )
        })?;
        let mut device = Self { functions, handle, version: [0; 3], file: file.to_owned(), _library: library };
        device.version = [c"versionMajor", c"versionMinor", c"versionPatch"].map(|name| device.integer(name));
        if device.version[0] != MAJOR {
            return Err(Unusable(format!("it is Open Image Denoise {}; version {MAJOR} is needed", device.version())));
        }
        device.commit(threads).map_err(|e| Unusable(e.to_string()))?;
        Ok(device)
    }

    fn commit(&self, threads: usize) -> Result<()> {
        let threads = c_int::try_from(threads).unwrap_or(c_int::MAX);
        // SAFETY: the device is alive and the names end in NUL. Threads are not bound to cores: several renders share a
        // machine.
        unsafe {
            (self.functions.set_device_int)(self.handle.as_ptr(), c"numThreads".as_ptr(), threads);
            (self.functions.set_device_bool)(self.handle.as_ptr(), c"setAffinity".as_ptr(), false);
            (self.functions.commit_device)(self.handle.as_ptr());
        }
        self.check()
    }

    fn integer(&self, name: &CStr) -> u32 {
        // SAFETY: the device is alive and the name ends in NUL.
        let value = unsafe { (self.functions.get_device_int)(self.handle.as_ptr(), name.as_ptr()) };
        u32::try_from(value).unwrap_or(0)
    }

    /// The library's version, such as 2.5.1.
    pub fn version(&self) -> String {
        let [major, minor, patch] = self.version;
        format!("{major}.{minor}.{patch}")
    }

    /// The library's file, or its bare name if the system found it.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Runs the library's filter for ray-traced pictures of `size` (width, height) pixels.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]; [`Error::Internal`] for what else the library reports and for pictures of another size.
    pub fn filter(&self, size: [usize; 2], inputs: Inputs, output: &mut [Triple]) -> Result<()> {
        let pictures = [(c"color", inputs.color), (c"albedo", inputs.albedo), (c"normal", inputs.normal)];
        let pixels = size[0].checked_mul(size[1]);
        if [Some(&*output)]
            .into_iter()
            .chain(pictures.iter().map(|(_, picture)| *picture))
            .flatten()
            .any(|p| Some(p.len()) != pixels)
        {
            return Err(Error::Internal(format!("a picture to denoise has not {} x {} pixels", size[0], size[1])));
        }
        let filter = Filter::new(self)?;
        let set = |name: &CStr, data: *const Triple| {
            let format = sys::FORMAT_FLOAT3;
            // SAFETY: the filter is alive, the name ends in NUL, and the data are `width * height` triples that stay
            // borrowed until the filter is released at the end of this function. Inputs are only read; the output is
            // borrowed for writing.
            unsafe {
                (self.functions.set_shared_filter_image)(
                    filter.handle.as_ptr(),
                    name.as_ptr(),
                    data.cast_mut().cast(),
                    format,
                    size[0],
                    size[1],
                    0,
                    0,
                    0,
                );
            }
        };
        for (name, picture) in pictures {
            if let Some(picture) = picture {
                set(name, picture.as_ptr());
            }
        }
        set(c"output", output.as_mut_ptr());
        for (name, value) in [(c"hdr", inputs.hdr), (c"cleanAux", inputs.clean_features)] {
            if value {
                // SAFETY: the filter is alive and the name ends in NUL.
                unsafe { (self.functions.set_filter_bool)(filter.handle.as_ptr(), name.as_ptr(), true) };
            }
        }
        // SAFETY: the filter is alive, and so are its pictures.
        unsafe { (self.functions.commit_filter)(filter.handle.as_ptr()) };
        self.check()?;
        // SAFETY: as above; the call returns when the output is complete.
        unsafe { (self.functions.execute_filter)(filter.handle.as_ptr()) };
        self.check()
    }

    /// The library's error since it was last queried on this thread.
    fn check(&self) -> Result<()> {
        match last_error(&self.functions, self.handle.as_ptr()) {
            None => Ok(()),
            Some(Fault { code: sys::ERROR_OUT_OF_MEMORY, message }) => {
                Err(Error::OutOfMemory(format!("Open Image Denoise: {message}")))
            }
            Some(Fault { message, .. }) => Err(Error::Internal(format!("Open Image Denoise: {message}"))),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: this is the only reference to the device, and filters borrow it.
        unsafe { (self.functions.release_device)(self.handle.as_ptr()) };
    }
}

// SAFETY: the library's calls are thread-safe, by its documentation; the handle is a counted reference.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

/// A filter, released when dropped.
struct Filter<'d> {
    device: &'d Device,
    handle: NonNull<OidnFilter>,
}

impl<'d> Filter<'d> {
    fn new(device: &'d Device) -> Result<Self> {
        // SAFETY: the device is alive and the name ends in NUL.
        let handle = unsafe { (device.functions.new_filter)(device.handle.as_ptr(), c"RT".as_ptr()) };
        device.check()?;
        let handle =
            NonNull::new(handle).ok_or_else(|| Error::Internal("Open Image Denoise has no filter RT".to_owned()))?;
        Ok(Self { device, handle })
    }
}

impl Drop for Filter<'_> {
    fn drop(&mut self) {
        // SAFETY: this is the only reference to the filter.
        unsafe { (self.device.functions.release_filter)(self.handle.as_ptr()) };
    }
}

struct Fault {
    code: c_int,
    message: String,
}

/// The first error of this thread, of a device or (null) of making one.
fn last_error(functions: &Functions, device: *mut OidnDevice) -> Option<Fault> {
    let mut message: *const c_char = null();
    // SAFETY: the device is alive or null, and the pointer is written.
    let code = unsafe { (functions.get_device_error)(device, &raw mut message) };
    if code == sys::ERROR_NONE {
        return None;
    }
    // SAFETY: if not null, the message ends in NUL and lives until the next call on this thread; it is copied here.
    let text = (!message.is_null()).then(|| unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned());
    Some(Fault { code, message: text.unwrap_or_else(|| format!("error {code}")) })
}

/// The system's message without the crate's words around it.
fn loader_message(error: &libloading::Error) -> String {
    std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string)
}
