//! Finds Embree, makes bindings to it and compiles the C shim.

use std::path::{Path, PathBuf};
use std::process::{Command, exit};

/// Ends the build with one line that says what to install.
fn fail(message: &str) -> ! {
    println!("cargo::error={message}");
    exit(1)
}

/// The library to link, by the newest header on the compiler's search path.
fn find_embree(compiler: &cc::Tool) -> &'static str {
    let has = |header: &str| {
        let source = PathBuf::from(std::env::var("OUT_DIR").unwrap_or_default()).join("probe.c");
        let text = format!("#include <{header}>\n");
        std::fs::write(&source, text).is_ok()
            && Command::new(compiler.path()).arg("-fsyntax-only").arg(&source).output().is_ok_and(|o| o.status.success())
    };
    if has("embree4/rtcore.h") {
        "embree4"
    } else if has("embree3/rtcore.h") {
        "embree3"
    } else {
        fail("Embree's header rtcore.h was not found; on Debian: apt-get install libembree-dev")
    }
}

/// Whether libclang, which bindgen loads, is installed.
fn has_libclang() -> bool {
    let named = std::env::var_os("LIBCLANG_PATH").is_some();
    let on_disk = |folder: &Path| {
        std::fs::read_dir(folder).is_ok_and(|d| d.flatten().any(|e| e.file_name().to_string_lossy().starts_with("libclang")))
    };
    let llvm = std::fs::read_dir("/usr/lib").into_iter().flatten().flatten().map(|e| e.path());
    named
        || llvm.filter(|p| p.to_string_lossy().contains("llvm")).any(|p| on_disk(&p.join("lib")))
        || ["/usr/lib", "/usr/lib64", "/usr/lib/x86_64-linux-gnu", "/usr/local/lib"].iter().any(|p| on_disk(Path::new(p)))
}

fn main() {
    println!("cargo::rerun-if-changed=ffi");
    println!("cargo::rerun-if-env-changed=LIBCLANG_PATH");
    let mut build = cc::Build::new();
    let compiler = build.try_get_compiler().unwrap_or_else(|_| fail("a C compiler is needed; on Debian: apt-get install build-essential"));
    if Command::new(compiler.path()).arg("--version").output().is_err() {
        fail("a C compiler is needed; on Debian: apt-get install build-essential");
    }
    let library = find_embree(&compiler);
    if !has_libclang() {
        fail("libclang is needed to read Embree's header; on Debian: apt-get install libclang-dev");
    }

    build.file("ffi/embree_shim.c").opt_level(2).warnings(true).compile("embree_shim");
    println!("cargo::rustc-link-lib=dylib={library}");

    let bindings = bindgen::Builder::default()
        .header("ffi/wrapper.h")
        .allowlist_function("rtc.*|st_.*")
        .allowlist_type("RTC.*|St.*")
        .allowlist_var("RTC_.*")
        .default_enum_style(bindgen::EnumVariation::ModuleConsts)
        .layout_tests(false)
        .generate_comments(false)
        .generate()
        .unwrap_or_else(|e| {
            fail(&format!("bindgen cannot read Embree's header: {e}; on Debian: apt-get install libembree-dev libclang-dev"))
        });
    let out = PathBuf::from(std::env::var("OUT_DIR").unwrap_or_default()).join("embree.rs");
    if let Err(e) = bindings.write_to_file(&out) {
        fail(&format!("cannot write {}: {e}", out.display()));
    }
}
