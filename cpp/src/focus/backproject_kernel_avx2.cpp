#define SARFOCUS_KERNELS_NAME kernels_avx2
#define SARFOCUS_KERNELS_LABEL "avx2"
#include "backproject_kernel.inl"
