//! The one integration-test binary.

/// Embree answers alike alone, in packets and from many threads.
mod accel_agreement;
mod adaptive;
/// Files of a scene that are missing or malformed.
mod bad_files;
/// Whatever a user gets wrong ends in one error with file and place.
mod bad_input;
/// Scenes beyond what can be rendered or written.
mod bad_limits;
/// The same for materials of several parts or many parameters.
mod bad_materials;
/// Accelerators compared from the command line.
mod bench_accel;
/// Error against time from the command line.
mod bench_error;
/// Time and memory as scenes grow, from the command line.
mod bench_scale;
/// The catalogue of checks from the command line.
mod bench_stability;
/// Works that comments cite, and the bibliography of the book.
mod bibliography;
/// Paths connected to paths from the lights.
mod bidirectional;
/// The book: its pages, scenes and links.
mod book;
/// What the cameras of the scene file see.
mod cameras;
/// Light that mirrors and glass throw on other surfaces, by photons.
mod caustics;
/// Renders that go on where they were stopped.
mod checkpoints;
/// The program as a user runs it: exit codes, files, messages.
mod cli;
/// Scenes written again.
mod conversion;
/// Curves, points and hair.
mod curves;
/// Surfaces with holes, the same ones for every accelerator and every kind of query.
mod cutouts;
/// Rays and instances at the end of what is one.
mod degenerate_input;
/// Denoising; what needs Open Image Denoise is passed over without it.
mod denoising;
/// The same picture for any number of threads, any crop, any accelerator; samples can be replayed.
mod determinism;
/// EXR files as users get them: profiles, checks, mattes, pictures rendered again.
mod exr_files;
/// Jobs for farms: their scripts with stand-ins for Slurm and the render.
mod farm;
/// Outputs that are inputs, or two of one name: refused by every command before it writes.
mod file_uses;
/// What is read and written that is no regular file, killed writers, and limits of the process.
mod files;
/// Known flaws of renderers in camera and film: each test fails on the flawed formula.
mod flaws_of_camera;
/// Known flaws of renderers in glass and in round shapes: each test fails on the flawed formula.
mod flaws_of_glass;
/// Known flaws of renderers in lights and light transport: each test fails on the flawed formula.
mod flaws_of_light;
/// Known flaws of renderers in textures and surfaces, beyond those of [`textures`] and [`relief`]: each test fails on
/// the flawed formula.
mod flaws_of_textures;
/// Sequences of frames from the command line.
mod frames;
/// Files that once broke readers, and the corpus of the fuzz targets.
mod fuzz_corpus;
/// The scenes that come with the program.
mod gallery;
/// Bottles and glasses of revolution, filled.
mod glassware;
/// glTF files as they look: which way up images, normals and glass are.
mod gltf_rendering;
mod guiding;
/// Guiding that a pilot decides on.
mod guiding_auto;
/// Media that differ from place to place, and distances chosen for lights.
mod heterogeneous_media;
/// Progress, logs, colours, configuration and manual pages.
mod hygiene;
/// What shapes, materials and instances are called in layers that pick them.
mod identities;
/// What instances place, seen and hit.
mod instances;
/// Renders by the program that are killed or answer signals.
mod interrupted;
/// The parts of the light, motion, and what denoisers need.
mod layers;
/// Several lights sampled at the first vertex of a path.
mod light_samples;
/// Integrators against closed forms, strategies against each other.
mod light_transport;
/// Measured and textured lights, lamps in objects, groups, clamping.
mod lights;
/// A render watched in browsers: what is served, to whom.
mod live_preview;
/// A render watched in tev.
mod live_tev;
/// Choosing among many lights.
mod many_lights;
/// Materials as scenes use them.
mod materials;
/// Measured materials.
mod measured_materials;
/// Media that overlap, absorb and part colours.
mod media;
/// What moves while the shutter is open: the same for every accelerator, and as if it stood still at each time.
mod motion;
/// Names of strangers: in messages, scripts and files, and where they would lead.
mod names;
/// Media within media.
mod nested_media;
/// Leaves cut out by images, for what the camera sees and for shadows.
mod opacity;
/// Our accelerators against the oracle: the same answers bit for bit, on anything, with bounded work.
mod own_accelerators;
/// Media that scatter and emit light.
mod participating_media;
/// Planes without end.
mod planes;
/// Normal maps, bump maps and smooth normals, without leaks and black rims.
mod relief;
/// Russian roulette by what paths are worth.
mod roulette;
/// Scenes far too small, too large or too far away for 32-bit coordinates.
mod scale;
/// All faults of a scene file at once, in plain words.
mod scene_faults;
/// Meshes, comments, names and transforms of scene files, read as users write them.
mod scene_files;
/// Renders in parts, put together.
mod shards;
/// Subdivision surfaces and displacement.
mod specular_direct;
mod splitting;
mod subdivision;
/// Random walks below surfaces.
mod subsurface;
/// Shadow as soft on coarse smooth meshes as on the surfaces they approximate, without leaks.
mod terminator;
/// Images smaller in the picture than they are.
mod texture_filtering;
/// Images on every shape, at seams and poles too.
mod textures;
/// Layers, lengths of files and functions, parameters, public names, unsafe code, printing.
mod tidy;
mod trained_guides;
/// What files may do: set what a picture is, but load, overwrite and connect to nothing.
mod trust;
/// Shared helpers.
mod util;
/// Colours of vertices: in pictures, from every kind of file, and what is refused.
mod vertex_colors;
/// Finished pictures in the browser: what is served of files, and which are refused.
mod view;
/// Options of the command line for view and focus.
mod views;
/// Files of OpenVDB and NanoVDB.
mod volume_files;
/// Scenes with such files.
mod volume_scenes;
