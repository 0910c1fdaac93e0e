#include "strata/mesh/openmesh_bridge.h"

namespace strata {

template OpenMeshTriMesh to_openmesh<OpenMeshTriMesh>(const TriangleSoup&, OpenMeshReport*);
template TriangleSoup from_openmesh<OpenMeshTriMesh>(const OpenMeshTriMesh&);

}  // namespace strata
