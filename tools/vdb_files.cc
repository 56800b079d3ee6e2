// Writes what Python's openvdb does not: vdb_files IN.vdb FOLDER writes the first grid of IN with other compressions, as
// doubles, as a stream, and in a frustum. Built and run by vdb_files.py.

#include <fstream>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

using namespace openvdb;

static void write(const std::string& path, GridBase::Ptr grid, uint32_t compression)
{
    io::File file(path);
    file.setCompression(compression);
    file.write(GridPtrVec{grid});
}

int main(int, char** arguments)
{
    initialize();
    const std::string folder = std::string(arguments[2]) + "/";
    io::File input(arguments[1]);
    input.open();
    const auto grid = gridPtrCast<FloatGrid>(input.readGrid(input.beginName().gridName()));
    // Fog volumes are never written with zip.
    grid->setGridClass(GRID_UNKNOWN);
    write(folder + "none.vdb", grid, io::COMPRESS_NONE);
    write(folder + "active.vdb", grid, io::COMPRESS_ACTIVE_MASK);
    write(folder + "zip.vdb", grid, io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK);
    write(folder + "zip_all.vdb", grid, io::COMPRESS_ZIP);
    write(folder + "blosc_all.vdb", grid, io::COMPRESS_BLOSC);

    const auto half = grid->deepCopy();
    half->setSaveFloatAsHalf(true);
    write(folder + "half_zip.vdb", half, io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK);

    const auto doubles = DoubleGrid::create(0.0);
    const auto vectors = Vec3DGrid::create(Vec3d(0.0));
    doubles->setName("density");
    vectors->setName("Cd");
    for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel) {
        const double value = *voxel;
        doubles->getAccessor().setValueOn(voxel.getCoord(), value);
        vectors->getAccessor().setValueOn(voxel.getCoord(), Vec3d(value, value / 2, 1));
    }
    doubles->setTransform(grid->transformPtr());
    vectors->setTransform(grid->transformPtr());
    write(folder + "double.vdb", doubles, io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK);
    write(folder + "vec3d.vdb", vectors, io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK);

    std::ofstream stream(folder + "stream.vdb", std::ios::binary);
    io::Stream(stream).write(GridPtrVec{grid});

    const auto frustum = grid->deepCopy();
    frustum->setTransform(math::Transform::createFrustumTransform(BBoxd(Vec3d(-30), Vec3d(0)), 0.5, 10.0, 1.0));
    write(folder + "frustum.vdb", frustum, io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK);
}
