#define SARFOCUS_KERNELS_NAME kernels_avx512
#define SARFOCUS_KERNELS_LABEL "avx512"
#include "backproject_kernel.inl"
