// A CUDA driver that computes nothing: it takes kernels and writes down what is asked of it.
//
// The compiler finds it as libcuda.so and believes in a card of compute capability 9.0. Memory is the host's, copies are
// made, launches are not. Each call that matters is a line of the file $CUDA_DRIVER_LOG, each module of PTX a file in the
// folder $CUDA_DRIVER_MODULES. So that tests see, without a card, whether all kernels compile for one, how many launches
// a frame takes, and how often the host waits for the card.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef int Result;  // 0 is success
typedef void *Handle;
enum { NAME = 256 };
static char some[NAME];  // what handles point to that nobody looks into

static FILE *book(void) {
    static FILE *file;
    if (!file && (file = fopen(getenv("CUDA_DRIVER_LOG"), "a"))) setvbuf(file, NULL, _IOLBF, 0);
    return file;
}

#define NOTED(...) return fprintf(book(), __VA_ARGS__), 0
#define NOTHING(name) \
    Result name(void) { return 0; }
#define UNKNOWN(name) \
    Result name(void) { NOTED("unknown " #name "\n"); }
#define GIVES(name, type, value) \
    Result name(type *out) { return *out = (value), 0; }

// The card.
NOTHING(cuInit)
NOTHING(cuCtxSetCurrent)
NOTHING(cuCtxSetLimit)
NOTHING(cuMemAdvise)
NOTHING(cuMemPoolSetAttribute)
NOTHING(cuMemPoolTrimTo)
GIVES(cuDriverGetVersion, int, 12080)
GIVES(cuDeviceGetCount, int, 1)
GIVES(cuDeviceGet, int, 0)
GIVES(cuDeviceGetDefaultMemPool, Handle, some)
GIVES(cuDevicePrimaryCtxRetain, Handle, some)
GIVES(cuCtxCreate_v2, Handle, some)
GIVES(cuCtxGetCurrent, Handle, some)

Result cuDeviceGetName(char *out, int room, int device) { return snprintf(out, room, "a driver that computes nothing"), 0; }

Result cuDeviceGetAttribute(int *out, int attribute, int device) {
    switch (attribute) {  // numbers of CUdevice_attribute
        case 1: case 2: case 3: *out = 1024; break;  // threads of a block
        case 4: *out = 64; break;
        case 5: case 6: case 7: *out = 2147483647; break;  // blocks
        case 8: *out = 49152; break;  // shared memory
        case 10: *out = 32; break;  // threads of a warp
        case 12: *out = 65536; break;  // registers
        case 16: *out = 132; break;  // multiprocessors
        case 39: *out = 2048; break;  // threads of one
        case 75: *out = 9; break;  // compute capability
        case 76: *out = 0; break;
        case 97: *out = 232448; break;
        case 106: *out = 32; break;
        default: *out = 1;
    }
    return 0;
}

// Memory.
static Result take(Handle *out, size_t size) { return *out = calloc(1, size ? size : 1), *out ? 0 : 2; }

static Result copy(const char *way, void *to, const void *from, size_t size) {
    if ((size_t)to > 4095 && (size_t)from > 4095) memcpy(to, from, size);  // what no kernel has made points nowhere
    NOTED("%s %zu\n", way, size);
}

Result cuMemGetInfo_v2(size_t *left, size_t *all) { return *left = *all = (size_t)80 << 30, 0; }
Result cuMemAlloc_v2(Handle *out, size_t size) { return take(out, size); }
Result cuMemAllocAsync(Handle *out, size_t size, Handle stream) { return take(out, size); }
Result cuMemAllocHost_v2(Handle *out, size_t size) { return take(out, size); }
Result cuMemAllocManaged(Handle *out, size_t size, unsigned flags) { return take(out, size); }
Result cuMemFree_v2(Handle of) { return free(of), 0; }
Result cuMemFreeAsync(Handle of, Handle stream) { return free(of), 0; }
Result cuMemFreeHost(Handle of) { return free(of), 0; }
Result cuMemcpyDtoH_v2(void *to, void *from, size_t size) { return copy("fetch", to, from, size); }
Result cuMemcpyDtoHAsync_v2(void *to, void *from, size_t size, Handle stream) { return copy("fetch", to, from, size); }
Result cuMemcpyHtoD_v2(void *to, void *from, size_t size) { return copy("send", to, from, size); }
Result cuMemcpyHtoDAsync_v2(void *to, void *from, size_t size, Handle stream) { return copy("send", to, from, size); }
Result cuMemcpyDtoD_v2(void *to, void *from, size_t size) { return copy("copy", to, from, size); }
Result cuMemsetD8_v2(void *to, unsigned char value, size_t size) { return memset(to, value, size), 0; }
Result cuMemsetD8Async(void *to, unsigned char value, size_t size, Handle stream) { return memset(to, value, size), 0; }
Result cuMemsetD32_v2(unsigned *to, unsigned value, size_t count) {
    while (count) to[--count] = value;
    return 0;
}
Result cuPointerGetAttribute(unsigned *out, int attribute, void *of) { return *out = 0, 1; }  // none of the card's

// Kernels.
static Result load(Handle *out, const char *image) {
    static int count;
    char name[4096];
    snprintf(name, sizeof name, "%s/%03d.ptx", getenv("CUDA_DRIVER_MODULES"), count++);
    FILE *file = fopen(name, "w");
    if (!file) return 1;
    fputs(image, file);
    return fclose(file), *out = some, 0;
}

Result cuModuleLoadData(Handle *out, const char *image) { return load(out, image); }
Result cuModuleLoadDataEx(Handle *out, const char *image, unsigned n, void *a, void *b) { return load(out, image); }
Result cuModuleGetFunction(char **out, Handle of, const char *name) {
    return snprintf(*out = malloc(NAME), NAME, "%s", name), 0;
}
Result cuFuncGetAttribute(int *out, int attribute, Handle of) { return *out = 32, 0; }
NOTHING(cuFuncSetAttribute)
GIVES(cuOccupancyMaxActiveBlocksPerMultiprocessor, int, 16)
Result cuLaunchKernel(char *kernel, unsigned x, unsigned y, unsigned z, unsigned threads) {
    NOTED("launch %s %u x %u\n", kernel, x, threads);
}

// Waiting.
NOTHING(cuStreamDestroy_v2)
NOTHING(cuStreamWaitEvent)
NOTHING(cuEventDestroy)
NOTHING(cuEventRecord)
GIVES(cuStreamCreate, Handle, some)
GIVES(cuEventCreate, Handle, some)
GIVES(cuEventElapsedTime, float, 0.001f)
Result cuCtxSynchronize(void) { NOTED("wait\n"); }
Result cuStreamSynchronize(Handle stream) { NOTED("wait\n"); }
Result cuEventSynchronize(Handle event) { NOTED("wait\n"); }
GIVES(cuGetErrorName, const char *, "error")
GIVES(cuGetErrorString, const char *, "an error of a driver that computes nothing")

// What the compiler looks for, and has not been seen to use.
UNKNOWN(cuExternalMemoryGetMappedBuffer)
UNKNOWN(cuExternalMemoryGetMappedMipmappedArray)
UNKNOWN(cuGraphAddEmptyNode)
UNKNOWN(cuGraphAddKernelNode)
UNKNOWN(cuGraphAddNode)
UNKNOWN(cuGraphConditionalHandleCreate)
UNKNOWN(cuGraphCreate)
UNKNOWN(cuGraphDestroy)
UNKNOWN(cuGraphExecDestroy)
UNKNOWN(cuGraphInstantiate)
UNKNOWN(cuGraphLaunch)
UNKNOWN(cuImportExternalMemory)
UNKNOWN(cuImportExternalSemaphore)
UNKNOWN(cuLinkAddData_v2)
UNKNOWN(cuLinkAddFile_v2)
UNKNOWN(cuLinkComplete)
UNKNOWN(cuLinkCreate_v2)
UNKNOWN(cuLinkDestroy)
UNKNOWN(cuMipmappedArrayGetLevel)
UNKNOWN(cuSignalExternalSemaphoresAsync)
UNKNOWN(cuSurfObjectCreate)
UNKNOWN(cuWaitExternalSemaphoresAsync)
