#define SARFOCUS_KERNELS_NAME kernels_baseline
#define SARFOCUS_KERNELS_LABEL "baseline"
#include "backproject_kernel.inl"
